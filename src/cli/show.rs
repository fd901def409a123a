//! The picture in the terminal: by kitty's or iTerm2's protocol, else as half blocks in colour.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use slicestack::Picture;
use std::fmt::Write as _;

/// Columns that half blocks take at most where the terminal does not tell its size.
const COLUMNS: u32 = 80;
const ROWS: u32 = 24;
/// Bytes of base64 that kitty takes at a time.
const CHUNK: usize = 4096;

/// A way to show pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Protocol {
    Kitty,
    Iterm,
    /// Two pixels a character: the upper half block's colour over the background's.
    Blocks,
}

impl Protocol {
    /// What the terminal that `variable` describes understands; it gives environment variables.
    pub(super) fn of(variable: impl Fn(&str) -> Option<String>) -> Self {
        let is = |name: &str, value: &str| variable(name).is_some_and(|v| v.eq_ignore_ascii_case(value));
        // Multiplexers pass neither protocol on unless told to.
        if variable("TMUX").is_some() || variable("STY").is_some() {
            return Self::Blocks;
        }
        if variable("KITTY_WINDOW_ID").is_some()
            || is("TERM", "xterm-kitty")
            || is("TERM", "xterm-ghostty")
            || is("TERM_PROGRAM", "ghostty")
        {
            return Self::Kitty;
        }
        if is("TERM_PROGRAM", "iTerm.app") || is("TERM_PROGRAM", "WezTerm") || is("LC_TERMINAL", "iTerm2") {
            return Self::Iterm;
        }
        Self::Blocks
    }
}

/// `picture` for a terminal of so many columns and rows, ending in a new line; `png` is the same picture.
pub(super) fn shown(picture: &Picture, png: &[u8], protocol: Protocol, (columns, rows): (u32, u32)) -> String {
    match protocol {
        Protocol::Kitty => kitty(png),
        Protocol::Iterm => format!("\x1b]1337;File=inline=1;size={};preserveAspectRatio=1:{}\x07\n", png.len(), STANDARD.encode(png)),
        Protocol::Blocks => blocks(picture, (columns, rows)),
    }
}

/// Columns and rows of the terminal, as far as it tells.
pub(super) fn size() -> (u32, u32) {
    let told = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok()).filter(|&n| n > 0);
    let term = console::Term::stdout().size_checked().map(|(rows, columns)| (u32::from(columns), u32::from(rows)));
    term.unwrap_or((told("COLUMNS").unwrap_or(COLUMNS), told("LINES").unwrap_or(ROWS)))
}

/// A PNG in pieces, of which all but the last say that more follow.
fn kitty(png: &[u8]) -> String {
    let text = STANDARD.encode(png);
    let mut out = String::new();
    let mut rest = text.as_str();
    let mut head = "a=T,f=100,";
    while !rest.is_empty() {
        let (piece, more) = rest.split_at(rest.len().min(CHUNK));
        let _ = write!(out, "\x1b_G{head}m={};{piece}\x1b\\", u8::from(!more.is_empty()));
        (rest, head) = (more, "");
    }
    out + "\n"
}

/// Half blocks: as large as fits into the terminal but a line, in the picture's proportions, never larger than the picture.
fn blocks(picture: &Picture, (columns, rows): (u32, u32)) -> String {
    let (width, height) = (picture.width(), picture.height());
    let (most_wide, most_high) = (columns.max(1), 2 * rows.saturating_sub(1).max(1));
    let scale = (f64::from(most_wide) / f64::from(width)).min(f64::from(most_high) / f64::from(height)).min(1.0);
    let wide = ((f64::from(width) * scale) as u32).max(1);
    let high = (((f64::from(height) * scale) as u32).max(1)).next_multiple_of(2);
    let mut text = String::new();
    for y in (0..high).step_by(2) {
        for x in 0..wide {
            let [top, below] = [mean(picture, (x, y), (wide, high)), mean(picture, (x, y + 1), (wide, high))];
            let _ = write!(text, "\x1b[38;2;{};{};{};48;2;{};{};{}m▀", top[0], top[1], top[2], below[0], below[1], below[2]);
        }
        text += "\x1b[0m\n";
    }
    text
}

/// Mean colour over black of the part of `picture` that cell `at` of so many covers, 0 to 255.
fn mean(picture: &Picture, at: (u32, u32), of: (u32, u32)) -> [u8; 3] {
    let range = |at: u32, of: u32, size: u32| {
        let first = (u64::from(at) * u64::from(size) / u64::from(of)).min(u64::from(size) - 1) as u32;
        first..((u64::from(at + 1) * u64::from(size)).div_ceil(u64::from(of)) as u32).clamp(first + 1, size)
    };
    let (xs, ys) = (range(at.0, of.0, picture.width()), range(at.1, of.1, picture.height()));
    let count = f64::from((xs.len() * ys.len()) as u32);
    let mut sum = [0.0; 3];
    for y in ys {
        for x in xs.clone() {
            let pixel = picture.pixels()[y as usize * picture.width() as usize + x as usize];
            (0..3).for_each(|c| sum[c] += f64::from(pixel[c]));
        }
    }
    sum.map(|s| (255.0 * (s / count).clamp(0.0, 1.0) + 0.5) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: u32, height: u32, color: impl Fn(u32, u32) -> [f32; 4]) -> Picture {
        let pixels = (0..width * height).map(|i| color(i % width, i / width)).collect();
        Picture::from_pixels(width, height, pixels).expect("a picture")
    }

    #[test]
    fn terminals_are_known_by_their_variables() {
        let of = |given: &[(&str, &str)]| Protocol::of(|name| given.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned()));
        assert_eq!(of(&[("TERM", "xterm-256color")]), Protocol::Blocks);
        assert_eq!(of(&[("TERM", "xterm-kitty")]), Protocol::Kitty);
        assert_eq!(of(&[("KITTY_WINDOW_ID", "3")]), Protocol::Kitty);
        assert_eq!(of(&[("TERM_PROGRAM", "WezTerm")]), Protocol::Iterm);
        assert_eq!(of(&[("LC_TERMINAL", "iTerm2")]), Protocol::Iterm);
        assert_eq!(of(&[("KITTY_WINDOW_ID", "3"), ("TMUX", "1")]), Protocol::Blocks);
    }

    /// Upper half red, lower half blue: each character of the middle row pair has both.
    #[test]
    fn half_blocks_hold_two_pixels_each() {
        let p = picture(6, 4, |_, y| if y < 2 { [1.0, 0.0, 0.0, 1.0] } else { [0.0, 0.0, 0.5, 0.5] });
        let text = blocks(&p, (80, 24));
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[0].matches('▀').count(), 6);
        assert!(lines[0].starts_with("\x1b[38;2;255;0;0;48;2;255;0;0m▀") && lines[0].ends_with("\x1b[0m"));
        assert!(lines[1].starts_with("\x1b[38;2;0;0;128;48;2;0;0;128m▀"));
        // In few columns it is smaller, in its proportions; and never larger than the terminal.
        for size in [(3, 24), (80, 2), (1, 1)] {
            let text = blocks(&p, size);
            assert!(text.lines().count() <= size.1.saturating_sub(1).max(1) as usize, "{size:?}");
            assert!(text.lines().all(|l| l.matches('▀').count() <= size.0 as usize), "{size:?}");
        }
    }

    #[test]
    fn kitty_gets_the_whole_file_in_pieces() {
        let png: Vec<u8> = (0..10_000).map(|i| (i % 251) as u8).collect();
        let text = kitty(&png);
        let mut found = String::new();
        let pieces: Vec<&str> = text.trim_end().split("\x1b\\").filter(|p| !p.is_empty()).collect();
        for (n, piece) in pieces.iter().enumerate() {
            let (head, data) = piece.strip_prefix("\x1b_G").and_then(|p| p.split_once(';')).expect("a piece");
            assert_eq!(head.starts_with("a=T,f=100,"), n == 0);
            assert!(head.ends_with(if n + 1 == pieces.len() { "m=0" } else { "m=1" }) && data.len() <= CHUNK);
            found += data;
        }
        assert_eq!(STANDARD.decode(found).expect("base64"), png);
    }
}
