//! BloscLZ, the codec that Blosc brings along: runs of literal bytes and copies of what came before.
//!
//! Source of the format: `blosclz.c` of <https://github.com/Blosc/c-blosc>, which follows FastLZ. A control byte below 32 is followed by one
//! literal byte more than it says. In another one the upper three bits give the length of a copy and the lower five the upper bits of the
//! distance; a length of 7 goes on in the bytes behind it, until one is not 255. The byte after these has the lower bits of the distance. A
//! distance of all ones goes on in two more bytes, the upper one first. The first control byte is always one of literals.

/// The distance from which on two more bytes follow.
const FAR: usize = 8191;

/// Fills `out` from the stream `bytes`.
pub(super) fn decode(bytes: &[u8], out: &mut [u8]) -> Result<(), String> {
    let (mut at, mut done) = (0, 0);
    let mut first = true;
    while at < bytes.len() {
        let mut next = || {
            let byte = bytes.get(at).copied();
            at += 1;
            byte.map(usize::from).ok_or_else(|| format!("blosclz: the stream of {} bytes ends within a copy", bytes.len()))
        };
        let control = next()? & if first { 31 } else { 255 };
        first = false;
        if control < 32 {
            let count = control + 1;
            let (Some(from), Some(to)) = (bytes.get(at..at + count), out.get_mut(done..done + count)) else {
                return Err(format!("blosclz: {count} literal bytes at byte {at} of {} do not fit", bytes.len()));
            };
            to.copy_from_slice(from);
            at += count;
            done += count;
            continue;
        }
        let mut length = (control >> 5) + 2;
        if length == 9 {
            loop {
                let more = next()?;
                length += more;
                if more < 255 {
                    break;
                }
            }
        }
        let mut distance = ((control & 31) << 8) + next()?;
        if distance == FAR {
            distance += next()? << 8;
            distance += next()?;
        }
        distance += 1;
        if distance > done || length > out.len() - done {
            return Err(format!("blosclz: a copy of {length} bytes from {distance} back at byte {done} of {}", out.len()));
        }
        copy(out, done, distance, length);
        done += length;
    }
    if done < out.len() {
        return Err(format!("blosclz: a stream of {} bytes ends after {done}", out.len()));
    }
    Ok(())
}

/// Writes `length` bytes at `at`, the first one that of `distance` before; they may be bytes just written.
fn copy(out: &mut [u8], at: usize, distance: usize, length: usize) {
    let from = at - distance;
    let mut done = 0;
    while done < length {
        // What is there already repeats: each time twice as much can be copied at once.
        let count = (distance + done).min(length - done);
        out.copy_within(from..from + count, at + done);
        done += count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8], length: usize) -> Result<Vec<u8>, String> {
        let mut out = vec![0; length];
        decode(bytes, &mut out).map(|()| out)
    }

    #[test]
    fn literals_and_copies_are_told_apart() {
        assert_eq!(decoded(&[2, b'a', b'b', b'c', 0x20, 2, 0, b'x'], 7).expect("valid"), b"abcabcx");
        // A copy of what it writes itself, of 7 + 255 + 3 + 2 bytes.
        let mut expected = vec![b'a'; 268];
        expected.push(b'x');
        assert_eq!(decoded(&[0, b'a', 0xe0, 255, 3, 0, 0, b'x'], 269).expect("valid"), expected);
        // From 8192 + 2 back.
        let mut stream = Vec::new();
        for i in 0..300u16 {
            stream.push(31);
            stream.extend((0..32).map(|j| (i * 5 + j) as u8));
        }
        let literal = decoded(&stream, 9600).expect("valid");
        stream.extend([0x3f, 255, 0, 2]);
        let all = decoded(&stream, 9603).expect("valid");
        assert_eq!(all[9600..], literal[9600 - 8194..][..3]);
    }

    #[test]
    fn what_does_not_fit_is_told() {
        for (bytes, length) in [
            (&[2, b'a'][..], 3),
            (&[2, b'a', b'b', b'c'], 2),
            (&[2, b'a', b'b', b'c'], 4),
            (&[0, b'a', 0x20, 1], 4),
            (&[0, b'a', 0x20], 4),
            (&[0, b'a', 0x40, 0], 4),
            (&[], 1),
        ] {
            assert!(decoded(bytes, length).is_err_and(|e| e.starts_with("blosclz: ")), "{bytes:?}");
        }
    }
}
