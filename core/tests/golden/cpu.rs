//! The type of this machine's CPU, as far as it can change the last bits of a result.

/// Architecture, widest vector instructions in use, and model: lists with equal descriptions are compared bit for bit.
pub(crate) fn description() -> String {
    let arch = std::env::consts::ARCH;
    format!("{arch} {} {}", vector_instructions(), model().unwrap_or_else(|| "unknown model".into()))
}

/// The widest vector instructions that the correlation may select.
#[cfg(target_arch = "x86_64")]
fn vector_instructions() -> &'static str {
    let wide = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512cd")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    match () {
        () if wide => "avx512",
        () if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") => "avx2",
        () => "sse2",
    }
}

/// The vector instructions that the architecture always has.
#[cfg(not(target_arch = "x86_64"))]
fn vector_instructions() -> &'static str {
    "baseline"
}

/// Vendor, name, family and model number from `/proc/cpuinfo`, if the operating system has it.
fn model() -> Option<String> {
    let text = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let field = |key: &str| {
        let line = text.lines().find(|line| line.split(':').next().is_some_and(|word| word.trim() == key))?;
        Some(line.split_once(':')?.1.trim().to_owned())
    };
    let (family, number) = (field("cpu family")?, field("model")?);
    Some(format!("{} {} family {family} model {number}", field("vendor_id")?, field("model name")?))
}
