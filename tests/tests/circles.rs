//! Files of a crate import one another in one direction only.
//!
//! The test reads `use` declarations and qualified paths as text. A path leads to the file that
//! defines its item, through any re-export in between; what a test module imports does not count,
//! nor does what a file takes from the one of the folder around it.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// A module by its path from the crate's root; the root has the empty path.
type Module = Vec<String>;

/// What a file defines, imports and re-exports.
struct File {
    defined: BTreeSet<String>,
    imported: Vec<Module>,
    exported: BTreeMap<String, Module>,
}

/// The files of a crate, by module.
struct Crate(BTreeMap<Module, File>);

#[test]
fn files_import_one_another_in_one_direction() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .expect("the tests stand in the project")
        .to_owned();
    let mut sources = Vec::new();
    for part in ["proto", "service", "clients/rust", "tests"] {
        find_sources(&root.join(part), &mut sources);
    }
    assert!(sources.len() > 10, "the walk has found the crates");
    let mut found = Vec::new();
    for source in sources {
        let name = source.strip_prefix(&root).unwrap_or(&source).display();
        for circle in Crate::read(&source).circles() {
            found.push(format!("{name}: {}", circle.join(", ")));
        }
    }
    assert!(
        found.is_empty(),
        "{}\nPut what both need into a file that imports neither.",
        found.join("\n")
    );
}

/// The `src` directories of the crates below a directory.
fn find_sources(directory: &Path, sources: &mut Vec<PathBuf>) {
    if directory.join("Cargo.toml").is_file() && directory.join("src").is_dir() {
        sources.push(directory.join("src"));
    }
    let Ok(entries) = fs::read_dir(directory) else {
        return;
    };
    for path in entries.flatten().map(|entry| entry.path()) {
        let name = path.file_name().unwrap_or_default();
        if path.is_dir()
            && !["src", "target", "fuzz"]
                .iter()
                .any(|skipped| name == *skipped)
        {
            find_sources(&path, sources);
        }
    }
}

impl Crate {
    fn read(source: &Path) -> Self {
        let (mut files, mut open) = (BTreeMap::new(), vec![source.to_owned()]);
        while let Some(directory) = open.pop() {
            for path in fs::read_dir(&directory).into_iter().flatten().flatten() {
                let path = path.path();
                if path.is_dir() {
                    open.push(path);
                } else if let Some(module) = module_of(source, &path) {
                    files.insert(module, File::read(&path));
                }
            }
        }
        Self(files)
    }

    /// Modules that import one another, each circle once.
    fn circles(&self) -> Vec<Vec<String>> {
        let modules: Vec<&Module> = self.0.keys().collect();
        let reached: BTreeMap<&Module, BTreeSet<&Module>> = modules
            .iter()
            .map(|module| (*module, self.reached_from(module)))
            .collect();
        let mut circles: BTreeSet<Vec<String>> = BTreeSet::new();
        for &module in &modules {
            let both = reached[module]
                .iter()
                .filter(|other| reached[*other].contains(module));
            let circle: Vec<String> = both.map(|module| module.join("/")).collect();
            if circle.len() > 1 {
                circles.insert(circle);
            }
        }
        circles.into_iter().collect()
    }

    /// All modules that a module leads to.
    fn reached_from<'a>(&'a self, module: &'a Module) -> BTreeSet<&'a Module> {
        let (mut reached, mut open) = (BTreeSet::new(), vec![module]);
        while let Some(from) = open.pop() {
            for path in &self.0[from].imported {
                let to = self
                    .absolute(from, path)
                    .and_then(|path| self.defining(&path, 0));
                // A module may build on what the file of the folder around it defines.
                if let Some(to) = to.filter(|to| !from.starts_with(to))
                    && reached.insert(to)
                {
                    open.push(to);
                }
            }
        }
        reached
    }

    /// A path from the crate's root; none where it leads into another crate.
    fn absolute(&self, module: &[String], path: &[String]) -> Option<Module> {
        let first = path.first()?;
        if first == "crate" {
            return Some(path[1..].to_vec());
        }
        let is_relative = |segment: &&String| *segment == "self" || *segment == "super";
        let ups = path.iter().take_while(is_relative).collect::<Vec<_>>();
        let above = ups.iter().filter(|segment| **segment == "super").count();
        let base = &module[..module.len().checked_sub(above)?];
        let joined = [base, &path[ups.len()..]].concat();
        let child = joined.get(..=base.len());
        let is_child = child.is_some_and(|child| self.0.contains_key(child));
        (!ups.is_empty() || is_child).then_some(joined)
    }

    /// The module whose file defines what a path from the root names.
    fn defining(&self, path: &[String], depth: usize) -> Option<&Module> {
        let mut module: Module = Vec::new();
        for segment in path {
            module.push(segment.clone());
            if self.0.contains_key(&module) {
                continue;
            }
            module.pop();
            let file = self.0.get(&module)?;
            let exported = file.exported.get(segment).filter(|_| depth < 8);
            if let Some(path) = exported.filter(|_| !file.defined.contains(segment)) {
                return self.defining(&self.absolute(&module, path)?, depth + 1);
            }
            break;
        }
        self.0.get_key_value(&module).map(|(module, _)| module)
    }
}

impl File {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_default();
        let code: Vec<&str> = text
            .lines()
            .take_while(|line| *line != "mod tests {")
            .map(|line| line.split("//").next().unwrap_or_default())
            .collect();
        let code = code.join("\n");
        let mut file = Self {
            defined: BTreeSet::new(),
            imported: Vec::new(),
            exported: BTreeMap::new(),
        };
        for statement in code.split(['\n', ';', '{', '}']) {
            file.defined.extend(definition(statement));
        }
        for statement in code.split(';').map(last_use) {
            let Some((is_exported, tree)) = statement else {
                continue;
            };
            for (path, name) in leaves(&[], tree) {
                if is_exported {
                    file.exported.insert(name, path);
                } else {
                    file.imported.push(path);
                }
            }
        }
        for prefix in ["crate::", "super::"] {
            for (at, _) in code.match_indices(prefix) {
                let path = code[at..].split(|c: char| !c.is_alphanumeric() && !"_:".contains(c));
                let path = path
                    .into_iter()
                    .next()
                    .unwrap_or_default()
                    .trim_end_matches(':');
                file.imported.push(segments(path));
            }
        }
        file
    }
}

/// The module of a file; none for a test's.
fn module_of(source: &Path, file: &Path) -> Option<Module> {
    let path = file.strip_prefix(source).ok()?.with_extension("");
    let mut module: Module = path
        .iter()
        .map(|part| part.to_string_lossy().into_owned())
        .collect();
    if ["mod", "lib", "main"].contains(&module.last()?.as_str()) {
        module.pop();
    }
    let is_test = module
        .iter()
        .any(|part| part.starts_with("tests") || part.ends_with("_tests"));
    let is_code = file.extension().is_some_and(|extension| extension == "rs");
    (is_code && !is_test).then_some(module)
}

/// The name that a statement defines.
fn definition(statement: &str) -> Option<String> {
    let kinds = [
        "struct",
        "enum",
        "trait",
        "fn",
        "const",
        "static",
        "type",
        "macro_rules!",
    ];
    let mut words = statement.split_whitespace();
    let skipped = ["pub", "async", "unsafe"];
    let mut word = words.next()?;
    while skipped.contains(&word)
        || word.starts_with("pub(")
        || word.ends_with("crate)")
        || word == "in"
    {
        word = words.next()?;
    }
    let name = kinds.contains(&word).then(|| words.next())??;
    let name = if name == "fn" { words.next()? } else { name };
    let end = name
        .find(|c: char| !c.is_alphanumeric() && c != '_')
        .unwrap_or(name.len());
    Some(name[..end].to_owned())
}

/// Whether a statement ends with a `use`, whether that is a re-export, and its tree.
fn last_use(statement: &str) -> Option<(bool, &str)> {
    let at = statement.rfind("use ")?;
    let before = statement[..at]
        .rsplit('\n')
        .next()
        .unwrap_or_default()
        .trim();
    let is_use = before.is_empty() || before.starts_with("pub");
    let is_word = statement[..at]
        .chars()
        .next_back()
        .is_none_or(char::is_whitespace);
    (is_use && is_word).then(|| (!before.is_empty(), statement[at + 4..].trim()))
}

/// The paths of a `use` tree, each with the name that it gets.
fn leaves(prefix: &[String], tree: &str) -> Vec<(Module, String)> {
    let (mut found, mut depth, mut begin) = (Vec::new(), 0, 0);
    let ends = tree.char_indices().filter_map(|(at, c)| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        (c == ',' && depth == 0).then_some(at)
    });
    let ends: Vec<usize> = ends.chain([tree.len()]).collect();
    for end in ends {
        let item = tree[begin..end].trim();
        begin = (end + 1).min(tree.len());
        if let Some((head, rest)) = item.split_once('{') {
            let head = [prefix, &segments(head)].concat();
            found.extend(leaves(&head, rest.trim_end().trim_end_matches('}')));
        } else if !item.is_empty() {
            let (path, renamed) = item.split_once(" as ").unwrap_or((item, ""));
            let mut path = [prefix, &segments(path)].concat();
            if path.last().is_some_and(|last| last == "self") {
                path.pop();
            }
            let last = path.last().cloned().unwrap_or_default();
            let name = if renamed.is_empty() {
                last
            } else {
                renamed.trim().to_owned()
            };
            found.push((path, name));
        }
    }
    found
}

fn segments(path: &str) -> Module {
    let parts = path.trim().split("::").map(str::trim);
    parts
        .filter(|part| !part.is_empty())
        .map(str::to_owned)
        .collect()
}
