#![no_main]

libfuzzer_sys::fuzz_target!(
    init: voxtile_fuzz::catch_panics(),
    |data: &[u8]| {
        voxtile_fuzz::clouds::e57(data);
    }
);
