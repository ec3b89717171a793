//! How wide a line may be: code, comments, manifests and the prose of documents.

use super::{Source, assert_none, sources};

/// Most columns of a line.
const COLUMNS_MAX: usize = 100;

/// A line that is too wide.
struct WideLine<'a> {
    text: &'a str,
    extension: &'a str,
}

impl WideLine<'_> {
    /// Whether it could be broken.
    fn can_be_broken(&self) -> bool {
        let text = self.text.trim_start();
        if self.extension != "md" && !is_comment(text) {
            return !self.is_in_literal() && !self.has_to_be_one_line();
        }
        // A table of a document, or of a comment that documents an item.
        let cells = text.trim_start_matches("//!").trim_start_matches("///");
        !cells.trim_start().starts_with('|') && !self.is_one_word()
    }

    /// Whether the last column that a line may have lies within a literal, or the line goes on with
    /// one: broken, it would be another text, or no longer one that can be searched for.
    fn is_in_literal(&self) -> bool {
        let within: String = self.text.chars().take(COLUMNS_MAX).collect();
        let marks = within.replace("\\\"", "").matches('"').count();
        within.contains("r#\"") || marks % 2 == 1 || self.text.ends_with("\\n\\")
    }

    /// Whether a tool reads it as one line: a dependency with its reason, which TOML cannot break;
    /// a target with its help; an exception of the type checker.
    fn has_to_be_one_line(&self) -> bool {
        match self.extension {
            "toml" => self.text.contains(" = {") || self.text.contains(".workspace = true"),
            "py" => self.text.contains("# type: ignore["),
            "" => self.text.contains(": ") && self.text.contains(" ## "),
            _ => false,
        }
    }

    /// Whether there is no space to break it at: a link, for example.
    fn is_one_word(&self) -> bool {
        let text = self.text.trim_start();
        let marks = ["//! ", "/// ", "// ", "#: ", "# ", "- "];
        let words = marks
            .iter()
            .find_map(|mark| text.strip_prefix(mark))
            .unwrap_or(text);
        let before = self.text.chars().count() - words.chars().count();
        !words
            .chars()
            .take(COLUMNS_MAX + 1 - before)
            .any(char::is_whitespace)
    }
}

fn is_comment(text: &str) -> bool {
    text.starts_with("//") || text.starts_with('#')
}

/// The lines of a source that are too wide and could be broken, each as `path:line`. Headings and
/// what stands between fences in a document stay as they are.
fn wide_lines(source: &Source) -> Vec<String> {
    let name = source.path.rsplit('/').next().unwrap_or_default();
    let (_, extension) = name.rsplit_once('.').unwrap_or((name, ""));
    let mut found = Vec::new();
    let mut is_fenced = false;
    for (index, text) in source.text.lines().enumerate() {
        let is_document = extension == "md";
        is_fenced ^= is_document && text.trim_start().starts_with("```");
        let is_left = is_document && (is_fenced || text.starts_with('#'));
        let line = WideLine { text, extension };
        if text.chars().count() > COLUMNS_MAX && !is_left && line.can_be_broken() {
            found.push(format!("{}:{}", source.path, index + 1));
        }
    }
    found
}

#[test]
fn lines_are_narrow() {
    let wide: Vec<_> = sources()
        .iter()
        .filter(|source| {
            source.has_extension(&["rs", "py", "toml", "md"]) || source.path == "Makefile"
        })
        .flat_map(wide_lines)
        .collect();
    assert_none(&wide, "Break the line: a window is a hundred columns wide.");
}

#[test]
fn only_lines_that_can_be_broken_are_wide() {
    let wide = |path: &str, text: &str| {
        let source = Source {
            path: path.to_owned(),
            text: text.to_owned(),
        };
        wide_lines(&source)
    };
    let words = "word ".repeat(30);
    let link = "x".repeat(120);
    for (path, text) in [
        ("a.rs", format!("let a = f({words});")),
        ("a.rs", format!("    /// {words}")),
        ("a.py", format!("#: {words}")),
        ("a.toml", format!("# {words}")),
        ("a.md", format!("- {words}")),
    ] {
        assert_eq!(wide(path, &text), [format!("{path}:1")], "{text}");
    }
    for (path, text) in [
        ("a.rs", format!("let a = \"{words}\";")),
        ("a.rs", format!("//! | {words} |")),
        ("a.rs", format!("/// {link} and more")),
        ("a.toml", format!("a = {{ version = 1 }} # {words}")),
        ("a.md", format!("| {words} |")),
        ("a.md", format!("```sh\n{words}\n```")),
        ("a.md", format!("[x](https://{link}) and more")),
    ] {
        assert_eq!(wide(path, &text), Vec::<String>::new(), "{text}");
    }
}
