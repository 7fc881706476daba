#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    voxtile_fuzz::clouds::messages(data);
});
