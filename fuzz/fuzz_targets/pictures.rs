#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| slicestack_fuzz::pictures::run(bytes));
