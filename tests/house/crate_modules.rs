//! The modules of a crate, the names that they import, and the files that a path leads to.
//!
//! Not seen: modules and paths that macros make, `include!`, methods of values whose type is not imported, and names of a
//! `#[cfg(test)]` module, which no other file depends on.

use std::collections::{BTreeMap, BTreeSet};

use crate::lexer::{Kind, Token, tokens};

/// A path, segment by segment.
type Path = Vec<String>;

/// An import, or a path in code.
#[derive(Debug)]
struct Use {
    module: usize,
    path: Path,
    line: usize,
    /// Of a public import: the name it gives. It counts as a use only if its file says that name elsewhere.
    re_exports: Option<String>,
}

#[derive(Debug, Default)]
struct Module {
    file: String,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    bindings: BTreeMap<String, Path>,
    globs: Vec<Path>,
    items: BTreeSet<String>,
}

/// A crate's modules.
#[derive(Debug, Default)]
pub(crate) struct Crate {
    modules: Vec<Module>,
    uses: Vec<Use>,
    /// Words of each file outside its imports.
    words: BTreeMap<String, BTreeSet<String>>,
}

/// An import of one file by another: who, whom, and the line.
pub(crate) type Import = (String, String, usize);

impl Crate {
    /// Reads a crate from its root file.
    pub(crate) fn read(sources: &BTreeMap<String, String>, root: &str) -> Self {
        let mut found = Self::default();
        let folder = folder_of(root);
        found.file(sources, root, None, folder);
        found
    }

    /// All imports between different files.
    pub(crate) fn imports(&self) -> Vec<Import> {
        let mut imports = Vec::new();
        for found in &self.uses {
            let from = &self.modules[found.module].file;
            if let Some(name) = &found.re_exports
                && !self.words[from].contains(name)
            {
                continue;
            }
            if let Some(to) = self.resolve(found.module, &found.path, 0)
                && to != *from
            {
                imports.push((from.clone(), to, found.line));
            }
        }
        imports
    }

    fn file(
        &mut self,
        sources: &BTreeMap<String, String>,
        path: &str,
        parent: Option<usize>,
        folder: String,
    ) -> usize {
        let module = self.add(path, parent);
        self.words.entry(path.to_owned()).or_default();
        let all: Vec<_> = tokens(&sources[path])
            .into_iter()
            .filter(|token| !matches!(token.kind, Kind::OuterDoc | Kind::InnerDoc))
            .collect();
        let mut at = 0;
        self.body(sources, &all, &mut at, module, &folder);
        module
    }

    fn add(&mut self, file: &str, parent: Option<usize>) -> usize {
        self.modules.push(Module {
            file: file.to_owned(),
            parent,
            ..Module::default()
        });
        self.modules.len() - 1
    }

    /// Reads the tokens of a module up to its closing brace.
    fn body(
        &mut self,
        sources: &BTreeMap<String, String>,
        all: &[Token<'_>],
        at: &mut usize,
        module: usize,
        folder: &str,
    ) {
        let mut depth = 0;
        let mut attribute = Attribute::default();
        while let Some(token) = all.get(*at) {
            let previous = at.checked_sub(1).map(|before| all[before]);
            match (token.kind, token.text) {
                (Kind::Sign, "}") if depth == 0 => return,
                (Kind::Sign, "}") => {
                    depth -= 1;
                    attribute = Attribute::default();
                }
                (Kind::Sign, "{") => depth += 1,
                (Kind::Sign, "#") => attribute.read(&all[*at..]),
                (Kind::Sign, ";") => attribute = Attribute::default(),
                // `use<'a>` in a type is no import.
                (Kind::Word, "use") if !all.get(*at + 1).is_some_and(|t| t.is_sign("<")) => {
                    self.import(all, at, module);
                }
                (Kind::Word, "mod") if all.get(*at + 1).is_some_and(|t| t.kind == Kind::Word) => {
                    self.declaration(sources, all, at, module, folder, &attribute);
                    attribute = Attribute::default();
                    continue;
                }
                (Kind::Word, _) => {
                    self.word(all, at, module, previous);
                    continue;
                }
                _ => {}
            }
            *at += 1;
        }
    }

    /// Reads `mod name;` or `mod name { ... }`.
    fn declaration(
        &mut self,
        sources: &BTreeMap<String, String>,
        all: &[Token<'_>],
        at: &mut usize,
        module: usize,
        folder: &str,
        attribute: &Attribute,
    ) {
        let name = all[*at + 1].text.to_owned();
        let opens = all.get(*at + 2).is_some_and(|token| token.is_sign("{"));
        *at += 3;
        let inner = format!("{folder}{name}/");
        if opens {
            let file = self.modules[module].file.clone();
            let child = self.add(&file, Some(module));
            let uses = self.uses.len();
            self.body(sources, all, at, child, &inner);
            *at += 1;
            if attribute.test {
                self.uses.truncate(uses);
            } else {
                self.modules[module].children.insert(name, child);
            }
            return;
        }
        let file = match &attribute.path {
            Some(path) => format!("{}{path}", folder_of(&self.modules[module].file)),
            None => format!("{folder}{name}.rs"),
        };
        let nested = format!("{inner}mod.rs");
        let (file, folder) = if sources.contains_key(&file) {
            let folder = match &attribute.path {
                Some(_) => folder_of(&file),
                None => inner,
            };
            (file, folder)
        } else if sources.contains_key(&nested) {
            (nested, inner)
        } else {
            return;
        };
        let child = self.file(sources, &file, Some(module), folder);
        self.modules[module].children.insert(name, child);
    }

    /// Reads an import up to its semicolon.
    fn import(&mut self, all: &[Token<'_>], at: &mut usize, module: usize) {
        let line = all[*at].line;
        let public = at
            .checked_sub(1)
            .is_some_and(|before| all[before].is_word("pub") || all[before].is_sign(")"));
        *at += 1;
        let mut paths = Vec::new();
        use_tree(all, at, &Vec::new(), &mut paths);
        for (path, name) in paths {
            let Some(name) = name else {
                self.modules[module].globs.push(path.clone());
                if !public {
                    let re_exports = None;
                    self.uses.push(Use {
                        module,
                        path,
                        line,
                        re_exports,
                    });
                }
                continue;
            };
            self.modules[module]
                .bindings
                .insert(name.clone(), path.clone());
            let re_exports = public.then_some(name);
            self.uses.push(Use {
                module,
                path,
                line,
                re_exports,
            });
        }
    }

    /// Reads a word that is no import: an item's name, or a path.
    fn word(
        &mut self,
        all: &[Token<'_>],
        at: &mut usize,
        module: usize,
        previous: Option<Token<'_>>,
    ) {
        const ITEMS: [&str; 9] = [
            "struct",
            "enum",
            "union",
            "trait",
            "type",
            "fn",
            "const",
            "static",
            "macro_rules",
        ];
        let token = all[*at];
        let item = previous.is_some_and(|before| ITEMS.contains(&before.text));
        if item {
            self.modules[module].items.insert(token.text.to_owned());
        }
        let member = previous.is_some_and(|before| before.is_sign("."));
        let file = self.modules[module].file.clone();
        if !item && !member {
            let words = self.words.entry(file).or_default();
            words.insert(token.text.to_owned());
        }
        let begins = !member && !previous.is_some_and(|before| before.is_sign("::"));
        let mut path = vec![token.text.to_owned()];
        *at += 1;
        while begins
            && all.get(*at).is_some_and(|token| token.is_sign("::"))
            && all
                .get(*at + 1)
                .is_some_and(|token| token.kind == Kind::Word)
        {
            path.push(all[*at + 1].text.to_owned());
            *at += 2;
        }
        if path.len() > 1 {
            let line = token.line;
            let re_exports = None;
            self.uses.push(Use {
                module,
                path,
                line,
                re_exports,
            });
        }
    }

    /// The file that a path leads to, if it is in this crate.
    fn resolve(&self, module: usize, path: &[String], depth: usize) -> Option<String> {
        // Names that import each other in a ring.
        if depth > 20 {
            return None;
        }
        let mut at = module;
        let mut rest = path;
        let mut anchored = false;
        while let Some((first, others)) = rest.split_first() {
            match first.as_str() {
                "crate" => at = 0,
                "self" => {}
                "super" => at = self.modules[at].parent?,
                _ => break,
            }
            anchored = true;
            rest = others;
        }
        while let Some((first, others)) = rest.split_first() {
            let here = &self.modules[at];
            if let Some(&child) = here.children.get(first) {
                at = child;
            } else if let Some(binding) = here.bindings.get(first) {
                // `use name::...;` where the name is another crate's.
                if binding.first() == Some(first) && !here.children.contains_key(first) {
                    return None;
                }
                let whole: Path = binding.iter().chain(others).cloned().collect();
                return self.resolve(at, &whole, depth + 1);
            } else if here.items.contains(first) {
                break;
            } else {
                let through_glob = here.globs.iter().find_map(|glob| {
                    let whole: Path = glob.iter().chain(rest).cloned().collect();
                    self.defines(at, glob, first, depth + 1)
                        .then(|| self.resolve(at, &whole, depth + 1))
                });
                if let Some(found) = through_glob {
                    return found;
                }
                return (anchored || at != module).then(|| here.file.clone());
            }
            anchored = true;
            rest = others;
        }
        anchored.then(|| self.modules[at].file.clone())
    }

    /// True if the module at the end of a path has this name.
    fn defines(&self, from: usize, path: &[String], name: &str, depth: usize) -> bool {
        if depth > 20 {
            return false;
        }
        let mut at = from;
        for segment in path {
            let next = match segment.as_str() {
                "crate" => Some(0),
                "self" => Some(at),
                "super" => self.modules[at].parent,
                _ => self.modules[at].children.get(segment).copied(),
            };
            let Some(next) = next else { return false };
            at = next;
        }
        let module = &self.modules[at];
        at != from
            && (module.items.contains(name)
                || module.children.contains_key(name)
                || module.bindings.contains_key(name))
    }
}

/// Attributes of the module that follows.
#[derive(Debug, Default)]
struct Attribute {
    path: Option<String>,
    test: bool,
}

impl Attribute {
    fn read(&mut self, all: &[Token<'_>]) {
        let texts: Vec<_> = all.iter().take(6).map(|token| token.text).collect();
        match texts.as_slice() {
            ["#", "[", "path", "=", path, ..] => self.path = Some((*path).to_owned()),
            ["#", "[", "cfg", "(", "test", ..] => self.test = true,
            _ => {}
        }
    }
}

/// Reads a tree of imports: for each its path, and its name unless it is a glob.
fn use_tree(
    all: &[Token<'_>],
    at: &mut usize,
    prefix: &Path,
    found: &mut Vec<(Path, Option<String>)>,
) {
    let mut path = prefix.clone();
    while let Some(token) = all.get(*at) {
        match (token.kind, token.text) {
            (Kind::Sign, "{") => {
                *at += 1;
                while all.get(*at).is_some_and(|token| !token.is_sign("}")) {
                    use_tree(all, at, &path, found);
                    if all.get(*at).is_some_and(|token| token.is_sign(",")) {
                        *at += 1;
                    }
                }
                *at += 1;
                return;
            }
            (Kind::Sign, "*") => {
                *at += 1;
                found.push((path, None));
                return;
            }
            (Kind::Word, "as") => {
                let name = all[*at + 1].text.to_owned();
                *at += 2;
                found.push((path, Some(name)));
                return;
            }
            (Kind::Word, "self") if !path.is_empty() => *at += 1,
            (Kind::Word, word) => {
                path.push(word.to_owned());
                *at += 1;
            }
            (Kind::Sign, "::") => *at += 1,
            _ => break,
        }
    }
    if let Some(name) = path.last().cloned() {
        found.push((path, Some(name)));
    }
}

/// The folder of a file, with a `/` at its end.
fn folder_of(file: &str) -> String {
    file.rsplit_once('/')
        .map_or(String::new(), |(folder, _)| format!("{folder}/"))
}
