use super::super::plot::{no_text_on_another, read};
use super::*;
use crate::Picture;

#[test]
fn every_lesson_draws_what_can_be_read_alone() {
    for (i, lesson) in LESSONS.iter().enumerate() {
        assert_eq!(lesson.number as usize, i + 1);
        let (told, drawing) = (lesson.make)().unwrap();
        assert!(told.lines().count() >= 5 && told.ends_with('\n'), "{}: {told}", lesson.name);
        // A title that names the lesson, and more words: axes, letters, legends.
        let said = read(&drawing);
        assert!(said.iter().any(|s| s.starts_with(&format!("Lesson {}: ", lesson.number))), "{}: {said:?}", lesson.name);
        assert!(said.len() >= 4, "{}: {said:?}", lesson.name);
        no_text_on_another(&drawing);
        let shown = lesson.run().unwrap();
        let picture = Picture::decode(&shown.picture, "lesson").unwrap();
        assert_eq!([picture.width(), picture.height()].map(f64::from), [2.0 * drawing.width, 2.0 * drawing.height].map(f64::ceil));
        assert_eq!(shown.told, told);
    }
}

/// What the lessons say is the case: numbers of their text, recomputed.
#[test]
fn lessons_tell_what_is_so() {
    let told: Vec<String> = LESSONS.iter().map(|l| l.run().unwrap().told).collect();
    assert!(told[0].contains(": 3 corners") && told[0].contains(": 6 corners"), "{}", told[0]);
    assert!(told[1].ends_with("0 pixels in both halves, 0 lost\n"), "{}", told[1]);
    // u = 0.02 * 8 - 1/2 = -0.34 lies in the cell before the first voxel.
    assert!(told[2].contains("s = 0.02: u = -0.34, cell -1, weight 0.66 (truncated: -0)"), "{}", told[2]);
    let found: Vec<&str> = told[2].lines().last().unwrap().split(['z', ';']).map(str::trim).collect();
    assert_eq!(found[1].trim_start_matches(": "), found[2].trim_start_matches("the library finds "), "{found:?}");
    // (1 - 0.5)^4 is let through by four lengths; in halves that are sqrt(0.5) each the same.
    assert_eq!(told[3].matches("4 lengths of it: 0.9375").count(), 2, "{}", told[3]);
    let sums: Vec<&str> = told[4].lines().take(3).map(|l| l.split_once('[').unwrap().1).collect();
    assert!(sums.iter().all(|s| *s == sums[0]), "{sums:?}");
    assert!(told[5].contains("A = 0: f C + (1 - f) A c_fog = [0.000, 0.000, 0.000]; without the A: [0."), "{}", told[5]);
}

#[test]
fn lessons_are_found_by_number_and_by_name() {
    assert_eq!(Lesson::named("3").map(|l| l.name), Some("fetch"));
    assert_eq!(Lesson::named("over").map(Lesson::file_name).as_deref(), Some("lesson_5_over.png"));
    assert!(Lesson::named("7").is_none() && Lesson::named("0").is_none() && Lesson::named("").is_none());
}
