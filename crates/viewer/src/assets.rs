//! The page's files, as they are in `web/`, in the program itself.

/// A file of the page.
pub(crate) struct Asset {
    pub(crate) name: &'static str,
    pub(crate) kind: &'static str,
    pub(crate) text: &'static str,
}

const SCRIPT: &str = "text/javascript; charset=utf-8";

macro_rules! asset {
    ($name:literal, $kind:expr) => {
        Asset { name: $name, kind: $kind, text: include_str!(concat!("../web/", $name)) }
    };
}

/// All but the document itself.
const ASSETS: [Asset; 13] = [
    asset!("style.css", "text/css; charset=utf-8"),
    asset!("icon.svg", "image/svg+xml"),
    asset!("main.js", SCRIPT),
    asset!("link.js", SCRIPT),
    asset!("camera.js", SCRIPT),
    asset!("pointer.js", SCRIPT),
    asset!("keys.js", SCRIPT),
    asset!("panel.js", SCRIPT),
    asset!("object.js", SCRIPT),
    asset!("plots.js", SCRIPT),
    asset!("region.js", SCRIPT),
    asset!("scenes.js", SCRIPT),
    asset!("store.js", SCRIPT),
];

/// The document, with a place for the token.
const DOCUMENT: &str = include_str!("../web/index.html");

/// The file of that name.
pub(crate) fn named(name: &str) -> Option<&'static Asset> {
    ASSETS.iter().find(|asset| asset.name == name)
}

/// The document for the owner of a token: its files are below a folder of that name.
pub(crate) fn document(token: &str) -> String {
    DOCUMENT.replace("%TOKEN%", token)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_that_the_page_names_is_there() {
        let mut found = 0;
        for text in ASSETS.iter().map(|asset| asset.text).chain([DOCUMENT]) {
            let modules = text.split("from \"./").skip(1).filter_map(|rest| rest.split('"').next());
            let linked = text.split("page/%TOKEN%/").skip(1).filter_map(|rest| rest.split('"').next());
            for name in modules.chain(linked) {
                assert!(named(name).is_some(), "{name}");
                found += 1;
            }
        }
        assert!(found > 10, "{found}");
        assert!(!ASSETS.iter().any(|asset| asset.text.contains("https://")), "nothing comes from elsewhere");
        assert!(document("abc").contains("page/abc/main.js") && !document("abc").contains('%'));
    }
}
