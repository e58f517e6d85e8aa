//! A file that the page made, given to the person: a download of the browser, else a file in the present folder.

/// Offers bytes as a file of that name.
///
/// # Errors
/// A sentence when the file cannot be written.
#[cfg(target_arch = "wasm32")]
pub(crate) fn keep(name: &str, media_type: &str, bytes: &[u8]) -> Result<(), String> {
    crate::page::web::download(name, media_type, bytes);
    Ok(())
}

/// Beside the program there is no browser that asks where to: the present folder, never over another file.
///
/// # Errors
/// A sentence when the file cannot be written.
#[cfg(not(target_arch = "wasm32"))]
pub(crate) fn keep(name: &str, _media_type: &str, bytes: &[u8]) -> Result<(), String> {
    let folder = std::env::current_dir().map_err(|e| format!("{name} cannot be written: {e}"))?;
    keep_in(&folder, name, bytes)
}

#[cfg(not(target_arch = "wasm32"))]
fn keep_in(folder: &std::path::Path, name: &str, bytes: &[u8]) -> Result<(), String> {
    use std::io::{ErrorKind, Write};
    let (stem, ending) = name.rsplit_once('.').unwrap_or((name, ""));
    let refused = |e: std::io::Error| format!("{name} cannot be written: {e}");
    for number in 0..1000 {
        let free = if number == 0 { name.to_owned() } else { format!("{stem}-{number}.{ending}") };
        match std::fs::File::create_new(folder.join(&free)) {
            Ok(mut file) => {
                return file.write_all(bytes).map_err(|e| {
                    // Half a file is worse than none.
                    let _ = std::fs::remove_file(folder.join(&free));
                    refused(e)
                });
            }
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            Err(e) => return Err(refused(e)),
        }
    }
    Err(format!("{name} cannot be written: a thousand files are called so already."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_file_is_written_over_and_a_refusal_is_a_sentence() {
        let folder = std::env::temp_dir().join(format!("sightline-keep-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        keep_in(&folder, "map.svg", b"first").unwrap();
        keep_in(&folder, "map.svg", b"second").unwrap();
        assert_eq!(std::fs::read(folder.join("map.svg")).unwrap(), b"first");
        assert_eq!(std::fs::read(folder.join("map-1.svg")).unwrap(), b"second");
        let refused = keep_in(&folder.join("no such folder"), "map.svg", b"").unwrap_err();
        assert!(refused.starts_with("map.svg cannot be written"), "{refused}");
        std::fs::remove_dir_all(folder).unwrap();
    }
}
