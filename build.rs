//! Whether the compiler knows the intrinsics of AVX-512, which are newer than the oldest Rust this crate is made for.

use std::process::Command;

/// The first version that has them: 1.89.
const SINCE: u32 = 89;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-check-cfg=cfg(slicestack_avx512)");
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let told = Command::new(rustc).arg("--version").output().ok();
    // "rustc 1.89.0 (...)"; what cannot be told is taken for an older one.
    let version = told.and_then(|t| String::from_utf8(t.stdout).ok()).unwrap_or_default();
    let minor = version.split('.').nth(1).and_then(|n| n.parse().ok()).unwrap_or(0);
    if minor >= SINCE {
        println!("cargo::rustc-cfg=slicestack_avx512");
    }
}
