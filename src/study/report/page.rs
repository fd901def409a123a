//! The frame of a page that needs nothing but itself.

use super::super::plot::escape;
use std::fmt::Write;

/// Colours in light and dark; the classes of the plots are variables of the same names.
const STYLE: &str = "
:root{color-scheme:light dark;--back:#fff;--fore:#1b1f24;--soft:#606870;--line:#dee2e6;--good:#00663d;--bad:#b00020;
--k-text:#1b1f24;--k-muted:#606870;--k-grid:#dee2e6;--k-paper:#fff;--k-faint:#b0b6bc;--k-0:#0060a0;--k-1:#c44e00;--k-2:#008060;--k-3:#963e80;--k-4:#806400;--k-5:#2c8cbe;--k-6:#464646}
@media (prefers-color-scheme:dark){:root{--back:#14171a;--fore:#e6e9ec;--soft:#a0a8b0;--line:#343a40;--good:#5fd39b;--bad:#ff8a8a;
--k-text:#e6e9ec;--k-muted:#a0a8b0;--k-grid:#30363c;--k-paper:#14171a;--k-faint:#565e66;--k-0:#64b4f0;--k-1:#ff9a52;--k-2:#4cc9a0;--k-3:#dc8cc8;--k-4:#d8b848;--k-5:#90d4f8;--k-6:#b4b4b4}}
body{margin:0 auto;max-width:940px;padding:16px;background:var(--back);color:var(--fore);font:16px/1.5 system-ui,sans-serif}
h1{font-size:1.6em;line-height:1.2}h2{margin-top:1.8em;font-size:1.25em}
figure{margin:1em 0}figcaption,.soft{color:var(--soft);font-size:.9em}
.faint:not(:hover):not(:focus){--k-0:var(--k-faint);--k-1:var(--k-faint);--k-2:var(--k-faint);--k-3:var(--k-faint);--k-4:var(--k-faint);--k-5:var(--k-faint);--k-6:var(--k-faint)}
.faint text{fill:var(--k-muted)!important}.faint:hover text,.faint:focus text{fill:var(--fore)!important;font-weight:600}
.faint{cursor:pointer}.faint:focus{outline:none}.faint:focus text{text-decoration:underline}
.strip{display:grid;grid-template-columns:repeat(auto-fit,minmax(145px,1fr));gap:12px}.strip figure{margin:0}
.strip img{display:block;width:100%;height:auto;image-rendering:pixelated;border:1px solid var(--line)}
sup{line-height:0}
svg{max-width:100%;height:auto;display:block}.narrow{display:none}
@media (max-width:700px){.wide{display:none}.narrow{display:block}}
.scroll{overflow-x:auto}table{border-collapse:collapse;font-size:.9em;margin:.8em 0}
th,td{text-align:left;padding:.25em .7em .25em 0;border-bottom:1px solid var(--line);vertical-align:top}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}td.n{white-space:nowrap}td:not(.n){min-width:7em}
.yes{color:var(--good)}.no{color:var(--bad);font-weight:600}
.pictures{display:grid;grid-template-columns:repeat(auto-fit,minmax(220px,1fr));gap:12px}.pictures figure{margin:0}
.pictures img{width:100%;height:auto;image-rendering:auto;border:1px solid var(--line)}
summary{cursor:pointer}code{font-size:.92em}
@media print{body{max-width:none}details{display:block}.wide{display:block}.narrow{display:none}figure,tr{break-inside:avoid}}
";

/// A page of `title` around `body`.
pub(super) fn page(title: &str, body: &str) -> String {
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, \
         initial-scale=1\">\n<title>{}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        escape(title)
    )
}

/// A cell of a table.
pub(super) enum Cell {
    Text(String),
    Number(String),
    /// Yes or no, in colour and in words.
    Holds(bool),
    /// Nothing, and why.
    Missing(&'static str),
}

impl Cell {
    /// A number that may not be there, and why it is not.
    pub(super) fn number<T>(value: Option<T>, say: impl Fn(T) -> String, why: &'static str) -> Self {
        value.map_or(Self::Missing(why), |x| Self::Number(say(x)))
    }
}

/// A table; a column of numbers is one that holds any. Where cells are empty, dashes stand in them, and the lines below say why.
pub(super) fn table(head: &[&str], rows: &[Vec<Cell>]) -> String {
    let number = |i: usize| rows.iter().any(|r| matches!(r.get(i), Some(Cell::Number(_))));
    let mut reasons: Vec<&str> = Vec::new();
    let mut out = String::from("<div class=\"scroll\"><table><thead><tr>");
    for (i, name) in head.iter().enumerate() {
        let class = if number(i) { " class=\"n\"" } else { "" };
        // Writing to a String cannot fail.
        let _ = write!(out, "<th{class}>{}</th>", escape(name));
    }
    out.push_str("</tr></thead><tbody>\n");
    for row in rows {
        out.push_str("<tr>");
        for (i, cell) in row.iter().enumerate() {
            let _ = match cell {
                Cell::Missing(why) => {
                    let at = reasons.iter().position(|r| r == why).unwrap_or_else(|| {
                        reasons.push(why);
                        reasons.len() - 1
                    });
                    let (class, why, at) = (if number(i) { " class=\"n\"" } else { "" }, escape(why), at + 1);
                    write!(out, "<td{class} title=\"{why}\">&ndash;<sup>{at}</sup></td>")
                }
                Cell::Text(text) => write!(out, "<td>{}</td>", escape(text)),
                Cell::Number(text) => write!(out, "<td class=\"n\">{}</td>", escape(text)),
                Cell::Holds(true) => write!(out, "<td class=\"yes\">holds</td>"),
                Cell::Holds(false) => write!(out, "<td class=\"no\">does not hold</td>"),
            };
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></div>\n");
    if !reasons.is_empty() {
        let list: Vec<String> = (1..).zip(&reasons).map(|(at, why)| format!("&ndash;<sup>{at}</sup> {}", escape(why))).collect();
        let _ = writeln!(out, "<p class=\"soft\">{}.</p>", list.join("; "));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_dash_is_explained_where_it_stands_and_below() {
        let rows = [
            vec![Cell::Text("a".into()), Cell::Missing("not < asked"), Cell::Number("1".into())],
            vec![Cell::Text("b".into()), Cell::Number("2".into()), Cell::Missing("no time")],
            vec![Cell::Missing("no time"), Cell::number(None::<f64>, |x| x.to_string(), "not < asked"), Cell::Holds(true)],
        ];
        let html = table(&["name", "x", "y"], &rows);
        assert_eq!(html.matches("title=\"not &lt; asked\">&ndash;<sup>1</sup></td>").count(), 2, "{html}");
        assert_eq!(html.matches("title=\"no time\">&ndash;<sup>2</sup></td>").count(), 2, "{html}");
        let (_, below) = html.split_once("</table></div>").expect("a line below the table");
        assert!(below.contains("&ndash;<sup>1</sup> not &lt; asked; &ndash;<sup>2</sup> no time."), "{below}");
        // Numbers stand to the right, though the first cell of the column is empty.
        assert_eq!(html.matches("class=\"n\"").count(), 2 + 5, "{html}");
        assert!(!table(&["name"], &[vec![Cell::Text("a".into())]]).contains("<p"));
    }
}
