//! What documents name is there.

use super::{assert_none, read, root, sources};

#[test]
fn links_between_documents_lead_somewhere() {
    let mut found = Vec::new();
    for source in sources()
        .iter()
        .filter(|source| source.has_extension(&["md"]))
    {
        let folder = root()
            .join(&source.path)
            .parent()
            .expect("a file's folder")
            .to_owned();
        for target in source
            .text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            let file = target.split('#').next().unwrap_or_default();
            if !target.contains("://") && !file.is_empty() && !folder.join(file).exists() {
                found.push(format!("{}: {target}", source.path));
            }
        }
    }
    assert_none(&found, "Correct the link, or write what it promises.");
}

#[test]
fn the_page_of_the_model_names_what_is_there() {
    let sources = sources();
    let page = read("docs/model.md");
    let rows = page.lines().filter(|line| line.starts_with("| "));
    let (mut found, mut named) = (Vec::new(), 0);
    for cells in rows.map(|row| row.split('|').skip(2).take(2)) {
        // Each of the two cells names a file and an item in it, in back quotes.
        for cell in cells.filter(|cell| cell.contains('`')) {
            let mut names = cell.split('`').skip(1).step_by(2);
            let (Some(file), Some(item)) = (names.next(), names.next()) else {
                found.push(format!("{cell}: no file and item"));
                continue;
            };
            named += 1;
            let end = format!("/{file}");
            let mut files = sources.iter().filter(|source| source.path.ends_with(&end));
            let defined = ["fn", "struct", "enum", "const"].map(|word| format!("{word} {item}"));
            let variant = format!("\n    {item},");
            let defines = |text: &str| {
                defined.iter().any(|line| text.contains(line)) || text.contains(&variant)
            };
            if !files.any(|source| defines(&source.text)) {
                found.push(format!("{file}: {item}"));
            }
        }
    }
    assert!(named > 40, "only {named} items were understood");
    assert_none(&found, "Name where it is now.");
}
