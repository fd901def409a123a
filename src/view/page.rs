//! The page's files, built in.

use super::http::Response;

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const PICTURE: &str = "image/svg+xml";

/// Path, type and text of every file. Nothing else is ever served.
const FILES: &[(&str, &str, &str)] = &[
    ("/", HTML, include_str!("page/index.html")),
    ("/style.css", STYLE, include_str!("page/style.css")),
    ("/icon.svg", PICTURE, include_str!("page/icon.svg")),
    ("/main.js", SCRIPT, include_str!("page/main.js")),
    ("/dom.js", SCRIPT, include_str!("page/dom.js")),
    ("/vectors.js", SCRIPT, include_str!("page/vectors.js")),
    ("/camera.js", SCRIPT, include_str!("page/camera.js")),
    ("/server.js", SCRIPT, include_str!("page/server.js")),
    ("/store.js", SCRIPT, include_str!("page/store.js")),
    ("/frames.js", SCRIPT, include_str!("page/frames.js")),
    ("/pointer.js", SCRIPT, include_str!("page/pointer.js")),
    ("/handles.js", SCRIPT, include_str!("page/handles.js")),
    ("/clips.js", SCRIPT, include_str!("page/clips.js")),
    ("/transfer.js", SCRIPT, include_str!("page/transfer.js")),
    ("/presets.js", SCRIPT, include_str!("page/presets.js")),
    ("/fields.js", SCRIPT, include_str!("page/fields.js")),
    ("/panels.js", SCRIPT, include_str!("page/panels.js")),
    ("/probe.js", SCRIPT, include_str!("page/probe.js")),
    ("/agree.js", SCRIPT, include_str!("page/agree.js")),
    ("/here.js", SCRIPT, include_str!("page/here.js")),
    ("/planes.js", SCRIPT, include_str!("page/planes.js")),
    ("/session.js", SCRIPT, include_str!("page/session.js")),
    ("/save.js", SCRIPT, include_str!("page/save.js")),
];

/// What is asked of a browser that shows the page: it fetches nothing from elsewhere, and is framed by `ancestors` alone.
pub(super) fn policy(ancestors: &[String]) -> String {
    let ancestors = if ancestors.is_empty() { "'none'".to_owned() } else { ancestors.join(" ") };
    format!(
        "default-src 'self'; img-src 'self' blob: data:; base-uri 'none'; form-action 'none'; object-src 'none'; frame-ancestors {ancestors}"
    )
}

/// The file at `path`, where there is one.
pub(super) fn file(path: &str) -> Option<Response> {
    let (_, kind, text) = FILES.iter().find(|(known, ..)| *known == path)?;
    Some(Response::new(kind, *text))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use std::path::Path;

    #[test]
    fn every_file_that_the_page_names_is_served() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/view/page");
        for entry in std::fs::read_dir(folder).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            // Those of exports go into files of their own.
            if !name.starts_with("export") && name != "index.html" {
                assert!(file(&format!("/{name}")).is_some(), "{name} is not served");
            }
        }
        for (_, _, text) in FILES {
            for module in text.split("from \"./").skip(1).filter_map(|rest| rest.split('"').next()) {
                assert!(file(&format!("/{module}")).is_some(), "{module} is imported and not served");
            }
        }
    }
}
