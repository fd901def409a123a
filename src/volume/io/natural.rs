//! The order of names in which the numbers in them count.

use std::cmp::Ordering;

/// The number that `text` starts with, without zeros in front, and the rest; or its first character and the rest.
fn split(text: &str) -> (bool, &str, &str) {
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    if digits > 0 {
        return (true, text[..digits].trim_start_matches('0'), &text[digits..]);
    }
    let first = text.chars().next().map_or(0, char::len_utf8);
    (false, &text[..first], &text[first..])
}

/// Order of names in which numbers count as such: `a2` before `a10`. Different names are never equal.
pub(super) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a, b);
    while !left.is_empty() && !right.is_empty() {
        let ((is_number, x, left_rest), (is_other, y, right_rest)) = (split(left), split(right));
        let order = if is_number && is_other {
            x.len().cmp(&y.len()).then_with(|| x.cmp(y))
        } else {
            left.chars().next().cmp(&right.chars().next())
        };
        if order != Ordering::Equal {
            return order;
        }
        (left, right) = (left_rest, right_rest);
    }
    // Where only zeros in front of numbers differ, the names themselves decide.
    (!left.is_empty()).cmp(&!right.is_empty()).then_with(|| a.cmp(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_in_names_count_as_numbers() {
        let sorted = [
            "1",
            "2",
            "10",
            "a",
            "a.png",
            "a0",
            "a00",
            "a1",
            "a01b",
            "a2",
            "a2b1",
            "a2b10",
            "a10",
            "a010c",
            "a99999999999999999999999",
            "b",
        ];
        in_order(&sorted);
        in_order(&["a", "a0", "a1", "a2", "a10", "a10b2", "a10b10", "b1", "b01x"]);
    }

    fn in_order(sorted: &[&str]) {
        for (i, a) in sorted.iter().enumerate() {
            for (j, b) in sorted.iter().enumerate() {
                assert_eq!(natural(a, b), i.cmp(&j), "{a} and {b}");
            }
        }
    }
}
