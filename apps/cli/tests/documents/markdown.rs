//! README.md and docs/**/*.md, and what is in them.

use pulldown_cmark::{CodeBlockKind, Event, OffsetIter, Options, Parser, Tag, TagEnd};
use std::path::{Path, PathBuf};

/// A page, and its place below the checkout's root.
pub(crate) struct Document {
    pub(crate) path: PathBuf,
    text: String,
}

/// A block of code; `language` is empty where it is indented.
pub(crate) struct Block {
    pub(crate) language: String,
    pub(crate) text: String,
    /// Of its first line of code, from 1.
    pub(crate) line: usize,
}

/// The checkout.
pub(crate) fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the checkout")
}

/// All pages in the order of their paths.
pub(crate) fn documents() -> Vec<Document> {
    let root = root();
    let mut paths = vec![PathBuf::from("README.md")];
    let mut folders = vec![PathBuf::from("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root.join(&folder)).expect("listed") {
            let entry = entry.expect("an entry");
            let path = folder.join(entry.file_name());
            if entry.path().is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|extension| extension == "md") {
                paths.push(path);
            }
        }
    }
    paths.sort();
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(root.join(&path)).expect("a text");
        Document::new(path, text)
    };
    paths.into_iter().map(read).collect()
}

impl Document {
    pub(crate) fn new(path: PathBuf, text: String) -> Self {
        Self { path, text }
    }

    fn events(&self) -> OffsetIter<'_> {
        Parser::new_ext(&self.text, Options::ENABLE_TABLES).into_offset_iter()
    }

    fn line(&self, byte: usize) -> usize {
        self.text[..byte].lines().count().max(1)
    }

    /// The page and a line, as editors take it.
    pub(crate) fn place(&self, line: usize) -> String {
        format!("{}:{line}", self.path.display())
    }

    /// All blocks of code.
    pub(crate) fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let mut inside = false;
        for (event, range) in self.events() {
            match event {
                Event::Start(Tag::CodeBlock(kind)) => {
                    let (language, fence) = match kind {
                        CodeBlockKind::Fenced(language) => (language.to_string(), 1),
                        CodeBlockKind::Indented => (String::new(), 0),
                    };
                    let line = self.line(range.start + 1) + fence;
                    blocks.push(Block { language, text: String::new(), line });
                    inside = true;
                }
                Event::End(TagEnd::CodeBlock) => inside = false,
                Event::Text(text) if inside => {
                    if let Some(block) = blocks.last_mut() {
                        block.text += &text;
                    }
                }
                _ => {}
            }
        }
        blocks
    }

    /// Targets of links and pictures, each with its line.
    pub(crate) fn links(&self) -> Vec<(usize, String)> {
        let target = |event| match event {
            Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) => {
                Some(dest_url.to_string())
            }
            _ => None,
        };
        self.events()
            .filter_map(|(event, range)| Some((self.line(range.start + 1), target(event)?)))
            .collect()
    }

    /// Code within lines of text, each with its line.
    pub(crate) fn inline_code(&self) -> Vec<(usize, String)> {
        let code = |event| match event {
            Event::Code(code) => Some(code.to_string()),
            _ => None,
        };
        self.events().filter_map(|(event, range)| Some((self.line(range.start + 1), code(event)?))).collect()
    }

    /// What `#...` can point at: headings in small letters, without punctuation, with hyphens for spaces. GitHub and
    /// mdBook agree on that.
    pub(crate) fn anchors(&self) -> Vec<String> {
        let mut anchors: Vec<String> = Vec::new();
        let mut inside = false;
        for (event, _) in self.events() {
            match event {
                Event::Start(Tag::Heading { .. }) => {
                    anchors.push(String::new());
                    inside = true;
                }
                Event::End(TagEnd::Heading(_)) => inside = false,
                Event::Text(text) | Event::Code(text) if inside => {
                    if let Some(anchor) = anchors.last_mut() {
                        anchor.extend(text.chars().filter_map(anchor_char));
                    }
                }
                _ => {}
            }
        }
        anchors
    }
}

fn anchor_char(c: char) -> Option<char> {
    match c {
        ' ' => Some('-'),
        c if c.is_alphanumeric() || c == '-' || c == '_' => c.to_lowercase().next(),
        _ => None,
    }
}
