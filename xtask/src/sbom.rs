//! The bill of materials of the program, in the format [CycloneDX 1.6](https://cyclonedx.org/docs/1.6/json/).
//!
//! It lists the components of the program and its page, not the tools that build or test them. It is derived from the
//! sources and the program only, so equal programs have equal bills.

use anyhow::{Context, Result};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::components::{Component, Embedded};
use crate::licences::canonical;
use crate::packages::Package;

/// The program that the bill describes.
pub(crate) struct Program<'a> {
    /// Version with the commit.
    pub(crate) version: &'a str,
    /// Version of the standard library.
    pub(crate) library: &'a str,
    /// Compilation target.
    pub(crate) target: &'a str,
    /// SHA-256, hexadecimal.
    pub(crate) sha256: &'a str,
    /// Time of the commit, ISO 8601; `None` if it is unknown.
    pub(crate) time: Option<&'a str>,
}

/// Creates the bill of materials.
pub(crate) fn sbom(components: &[Component<'_>], program: &Program<'_>) -> Result<Value> {
    let own = reference_of("sightline", program.version);
    let library = reference_of("std", program.library);
    let mut entries = vec![json!({
        "type": "library",
        "bom-ref": library,
        "name": "std",
        "version": program.library,
        "description": "The standard library of Rust",
        "licenses": [{ "expression": "MIT OR Apache-2.0" }],
        "externalReferences": [{ "type": "vcs", "url": "https://github.com/rust-lang/rust" }],
    })];
    for component in components {
        entries.push(entry(component)?);
    }
    let is_main = |component: &&Component<'_>| {
        matches!(component.package.name.as_str(), "sightline-server" | "sightline-viewer")
    };
    let mut main: Vec<_> =
        components.iter().filter(is_main).map(|component| reference(component.package)).collect();
    main.push(library.clone());
    let mut dependencies = vec![json!({ "ref": own, "dependsOn": main }), json!({ "ref": library })];
    dependencies.extend(components.iter().map(|component| {
        let needs: Vec<_> = component.needs.iter().map(|needed| reference(needed)).collect();
        json!({ "ref": reference(component.package), "dependsOn": needs })
    }));
    let unknown = files_with_unknown_components(components);
    let mut sbom = json!({
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "serialNumber": serial_number(program),
        "version": 1,
        "metadata": {
            "lifecycles": [{ "phase": "build" }],
            "tools": { "components": [{ "type": "application", "name": "cargo xtask dist" }] },
            "component": {
                "type": "application",
                "bom-ref": own,
                "name": "sightline",
                "version": program.version,
                "licenses": [{ "expression": "MIT OR Apache-2.0" }],
                "hashes": [{ "alg": "SHA-256", "content": program.sha256 }],
                "properties": [{ "name": "sightline:target", "value": program.target }],
            },
        },
        "components": entries,
        "dependencies": dependencies,
    });
    if !unknown.is_empty() {
        sbom["compositions"] = json!([{ "aggregate": "incomplete", "assemblies": unknown }]);
    }
    if let Some(time) = program.time {
        sbom["metadata"]["timestamp"] = time.into();
    }
    Ok(sbom)
}

/// References to the embedded files whose own components are unknown.
fn files_with_unknown_components(components: &[Component<'_>]) -> Vec<String> {
    let mut references = Vec::new();
    for component in components {
        for file in component.embedded.iter().filter(|file| file.has_unknown_components) {
            references.push(file_reference(component, file));
        }
    }
    references
}

/// A package as a component.
fn entry(component: &Component<'_>) -> Result<Value> {
    let Package { name, version, license, source, description, repository, .. } = component.package;
    let licence = license.as_deref().with_context(|| format!("{name} {version} declares no licence"))?;
    let mut entry = json!({
        "type": "library",
        "bom-ref": reference(component.package),
        "name": name,
        "version": version,
        "licenses": [{ "expression": canonical(licence) }],
        "properties": [{ "name": "sightline:place", "value": component.location() }],
    });
    if let Some(description) = description {
        entry["description"] = description.trim().into();
    }
    if source.is_some() {
        entry["purl"] = format!("pkg:cargo/{name}@{}", version.replace('+', "%2B")).into();
    }
    if let Some(checksum) = component.checksum {
        entry["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
    }
    if let Some(url) = repository.as_deref().filter(|url| url.starts_with("https://")) {
        entry["externalReferences"] = json!([{ "type": "vcs", "url": url }]);
    }
    if !component.embedded.is_empty() {
        let files = component.embedded.iter().map(|embedded| file(component, embedded));
        entry["components"] = files.collect::<Result<Vec<_>>>()?.into();
    }
    Ok(entry)
}

/// A file inside a package as a component.
fn file(component: &Component<'_>, embedded: &Embedded) -> Result<Value> {
    let path = component.folder().join(embedded.file);
    let content = std::fs::read(&path).with_context(|| format!("{} cannot be read", path.display()))?;
    Ok(json!({
        "type": "file",
        "bom-ref": file_reference(component, embedded),
        "name": embedded.file,
        "licenses": [{ "expression": embedded.licence }],
        "hashes": [{ "alg": "SHA-256", "content": sha256(&content) }],
    }))
}

fn reference(package: &Package) -> String {
    reference_of(&package.name, &package.version)
}

fn reference_of(name: &str, version: &str) -> String {
    format!("{name}@{version}")
}

fn file_reference(component: &Component<'_>, embedded: &Embedded) -> String {
    format!("{}#{}", reference(component.package), embedded.file)
}

/// A UUID of version 8 (RFC 9562) derived from the digest of the program.
fn serial_number(program: &Program<'_>) -> String {
    let digits = sha256(format!("{} {}", program.version, program.sha256).as_bytes());
    let [a, b, c, d, e] = [&digits[..8], &digits[8..12], &digits[13..16], &digits[17..20], &digits[20..32]];
    format!("urn:uuid:{a}-{b}-8{c}-8{d}-{e}")
}

/// SHA-256, 64 hexadecimal digits.
pub(crate) fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::components;
    use crate::packages::host;

    #[test]
    fn each_component_is_listed_once_with_licence_and_digest() {
        let host = host().expect("a compiler");
        let packages = components::packages(&host).expect("packages");
        let components = components::components(&packages, &host).expect("parts");
        let digest = sha256(b"the program");
        let program =
            Program { version: "0 (1)", library: "1.0.0", target: &host, sha256: &digest, time: None };
        let sbom = sbom(&components, &program).expect("a bill");
        assert_eq!(sbom, super::sbom(&components, &program).expect("the same"));
        let entries = sbom["components"].as_array().expect("components");
        let references: BTreeSet<_> = entries.iter().map(|component| component["bom-ref"].as_str()).collect();
        assert_eq!(references.len(), entries.len());
        assert_eq!(entries.len(), components.len() + 1);
        let named =
            |name: &str| entries.iter().find(|component| component["name"] == name).expect("a component");
        assert_eq!(named("axum")["properties"][0]["value"], "program");
        assert_eq!(named("egui")["properties"][0]["value"], "page");
        assert_eq!(named("axum")["hashes"][0]["content"].as_str().map(str::len), Some(64));
        let fonts = named("epaint_default_fonts")["components"].as_array().expect("fonts");
        assert!(fonts.iter().any(|font| font["licenses"][0]["expression"] == "OFL-1.1"));
        for dependency in sbom["dependencies"].as_array().expect("dependencies") {
            for needed in dependency["dependsOn"].as_array().into_iter().flatten() {
                assert!(references.contains(&needed.as_str()), "{needed} is no component");
            }
        }
    }

    #[test]
    fn serial_numbers_are_uuids() {
        let program = Program { version: "0", library: "", target: "", sha256: "00", time: None };
        let number = serial_number(&program);
        let groups: Vec<_> = number.trim_start_matches("urn:uuid:").split('-').map(str::len).collect();
        assert_eq!(groups, [8, 4, 4, 4, 12]);
    }
}
