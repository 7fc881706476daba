use bytes::Bytes;
use std::sync::LazyLock;

/// One file of the page.
pub struct PageFile {
    pub name: &'static str,
    pub kind: &'static str,
    pub plain: Bytes,
    /// Content, compressed with gzip.
    pub gzip: Bytes,
}

/// Files of the page, built by `page/bundle.sh`.
const FILES: [(&str, &str, &[u8]); 4] = [
    ("index.html", "text/html; charset=utf-8", include_bytes!("../page/dist/index.html")),
    ("page.js", "text/javascript; charset=utf-8", include_bytes!("../page/dist/page.js")),
    ("page.css", "text/css; charset=utf-8", include_bytes!("../page/dist/page.css")),
    ("licences.txt", "text/plain; charset=utf-8", include_bytes!("../page/dist/licences.txt")),
];

static PAGE: LazyLock<Vec<PageFile>> = LazyLock::new(|| {
    let file = |(name, kind, bytes)| {
        let gzip = super::response::gzip(bytes).into();
        PageFile { name, kind, plain: Bytes::from_static(bytes), gzip }
    };
    FILES.map(file).into()
});

pub fn file(name: &str) -> Option<&'static PageFile> {
    PAGE.iter().find(|file| file.name == name)
}

/// Returns all files of the page.
pub fn files() -> &'static [PageFile] {
    &PAGE
}
