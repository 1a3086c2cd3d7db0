#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| (descry_tests::fuzz::target("phrase").judge)(input));
