#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| slicestack_fuzz::transfer_files::run(bytes));
