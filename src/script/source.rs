//! The script's text and its imports: read once, hashed, and kept for diagnostics, for the
//! results folder and for the worker threads, which compile it again.

use std::collections::BTreeMap;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::diagnostic::{Diagnostic, Place};

/// The longest source that is parsed, in bytes: parsing 10 MB would take over 20 s.
pub(super) const MAX_SOURCE: u64 = 256 * 1024;

/// One file of a script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Its name as diagnostics show it: the path as given, imports relative to the script.
    pub name: Arc<str>,
    /// Its text.
    pub text: Arc<str>,
}

impl Source {
    /// SHA-256 of the text, in hexadecimal.
    pub fn sha256(&self) -> String {
        hex(&Sha256::digest(self.text.as_bytes()))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, is empty, is too long, or is not UTF-8 text.
    pub fn read(path: &Path, name: Arc<str>) -> Result<Self, Diagnostic> {
        let fail = |what: String| Diagnostic::error(format!("{name}: {what}"));
        let metadata = std::fs::metadata(path).map_err(|e| {
            let error = fail(format!("cannot be read: {}", plain(&e)));
            if path.extension().is_none() && path.with_extension("rhai").is_file() {
                return error
                    .hint(format!("did you mean `{}`?", path.with_extension("rhai").display()));
            }
            error
        })?;
        if metadata.is_dir() {
            return Err(fail("is a directory, not a script".into()));
        }
        if !metadata.is_file() {
            return Err(fail("is no regular file, so no script".into()));
        }
        if metadata.len() > MAX_SOURCE {
            return Err(fail(format!(
                "{} bytes are too long for a script (at most {MAX_SOURCE})",
                metadata.len()
            )));
        }
        let mut bytes = Vec::new();
        // Files such as those of /proc say that they are empty.
        std::fs::File::open(path)
            .and_then(|file| file.take(MAX_SOURCE + 1).read_to_end(&mut bytes))
            .map_err(|e| fail(format!("cannot be read: {}", plain(&e))))?;
        if bytes.len() as u64 > MAX_SOURCE {
            return Err(fail(format!("is too long for a script (at most {MAX_SOURCE} bytes)")));
        }
        let text = String::from_utf8(bytes).map_err(|e| {
            fail(format!("is not UTF-8 text (byte {})", e.utf8_error().valid_up_to()))
        })?;
        if text.trim().is_empty() {
            return Err(fail("is empty".into()).hint("`runner new NAME` writes one to start from"));
        }
        Ok(Self { name, text: text.into() })
    }
}

/// An I/O error without Rust's "(os error 2)".
pub(crate) fn plain(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or(&text).to_lowercase()
}

/// Bytes in hexadecimal.
pub(crate) fn hex(bytes: &[u8]) -> String {
    let digit = |n: u8| char::from_digit(n.into(), 16).expect("four bits");
    bytes.iter().flat_map(|b| [digit(b >> 4), digit(b & 15)]).collect()
}

/// A script and everything it imports.
#[derive(Debug, Clone)]
pub struct SourceSet {
    /// The folder that imports are relative to and must stay in.
    root: PathBuf,
    /// The script itself.
    pub script: Source,
    /// Imported files by their path relative to the script's folder (`lib/shapes.rhai`).
    pub imports: BTreeMap<String, Source>,
}

impl SourceSet {
    /// Reads the script; imports are added as it asks for them.
    ///
    /// # Errors
    /// As [`Source::read`].
    pub fn open(path: &Path) -> Result<Self, Diagnostic> {
        let script = Source::read(path, path.display().to_string().into())?;
        let root = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok(Self { root, script, imports: BTreeMap::new() })
    }

    /// A script that exists as text only; it cannot import.
    pub fn from_text(name: &str, text: &str) -> Self {
        Self {
            root: PathBuf::new(),
            script: Source { name: name.into(), text: text.into() },
            imports: BTreeMap::new(),
        }
    }

    /// The imported file `path`, as named in `from` (the importing file's path relative to the
    /// root, or `None` for the script). Returns its path relative to the root and its text.
    ///
    /// # Errors
    /// If the path leaves the script's folder, or the file cannot be read.
    pub(super) fn import(
        &mut self,
        from: Option<&str>,
        path: &str,
    ) -> Result<(String, Source), Diagnostic> {
        let relative = resolve_import(from, path)?;
        if let Some(source) = self.imports.get(&relative) {
            return Ok((relative, source.clone()));
        }
        let file = self.root.join(&relative);
        // A symbolic link could still lead out of the folder.
        let inside = match (file.canonicalize(), self.canonical_root()) {
            (Ok(file), Some(root)) => file.starts_with(root),
            _ => true,
        };
        if !inside {
            return Err(Diagnostic::error(format!(
                "import `{path}` leads out of the script's folder"
            )));
        }
        let name = self.root.join(&relative).display().to_string();
        let source = Source::read(&file, name.into())?;
        self.imports.insert(relative.clone(), source.clone());
        Ok((relative, source))
    }

    fn canonical_root(&self) -> Option<PathBuf> {
        let root = if self.root.as_os_str().is_empty() { Path::new(".") } else { &self.root };
        root.canonicalize().ok()
    }

    /// The source line at `place`.
    pub fn line(&self, place: &Place) -> Option<String> {
        let all = std::iter::once(&self.script).chain(self.imports.values());
        let source = all.into_iter().find(|s| s.name == place.file)?;
        source.text.lines().nth(place.line.checked_sub(1)?).map(str::to_string)
    }

    /// `diagnostic` with its source line filled in.
    pub fn annotate(&self, mut diagnostic: Diagnostic) -> Diagnostic {
        if let Some(place) = &diagnostic.place {
            diagnostic.source_line = self.line(place).map(Into::into);
        }
        diagnostic
    }
}

/// Files with their bytes; `None` for one that cannot be read.
pub type Snapshot = BTreeMap<PathBuf, Option<Vec<u8>>>;

/// The script at `path` and every file that it imports, directly or through others, missing ones
/// included. Nothing is run: imports are found in the text.
pub fn snapshot(path: &Path) -> Snapshot {
    let root = path.parent().unwrap_or(Path::new(""));
    let mut files = Snapshot::new();
    // By their paths relative to the root; `None` for the script.
    let mut todo: Vec<Option<String>> = vec![None];
    while let Some(relative) = todo.pop() {
        let file = relative.as_ref().map_or(path.to_path_buf(), |relative| root.join(relative));
        if files.contains_key(&file) {
            continue;
        }
        let bytes = beginning(&file);
        let text = bytes.as_ref().map_or("".into(), |bytes| String::from_utf8_lossy(bytes));
        let found = tokens(&text);
        let imports = found.windows(2).filter(|pair| pair[0].text == "import");
        let imports = imports.filter_map(|pair| {
            let path = pair[1].text.strip_prefix(['"', '`'])?.strip_suffix(['"', '`'])?;
            resolve_import(relative.as_deref(), path).ok()
        });
        todo.extend(imports.map(Some));
        files.insert(file, bytes);
    }
    files
}

/// A file's bytes, as many as a script may have and one more.
fn beginning(path: &Path) -> Option<Vec<u8>> {
    // A pipe would block.
    let file = path.is_file().then(|| std::fs::File::open(path).ok()).flatten()?;
    let mut bytes = Vec::new();
    file.take(MAX_SOURCE + 1).read_to_end(&mut bytes).ok()?;
    Some(bytes)
}

/// `path` seen from the file `from`, normalised, with `.rhai` added if it has no extension.
pub(super) fn resolve_import(from: Option<&str>, path: &str) -> Result<String, Diagnostic> {
    let outside = || {
        Diagnostic::error(format!("import `{path}` leads out of the script's folder"))
            .hint("a script may import files beside it and below it only")
    };
    if path.starts_with('/') || path.contains('\\') || path.contains(':') || path.contains('\0') {
        return Err(outside());
    }
    let mut parts: Vec<&str> = from.map_or(Vec::new(), |f| f.split('/').collect());
    parts.pop();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop().ok_or_else(outside)?;
            }
            part => parts.push(part),
        }
    }
    let mut relative = parts.join("/");
    if Path::new(&relative).extension().is_none() {
        relative.push_str(".rhai");
    }
    Ok(relative)
}

/// Splits Rhai source into tokens, leaving out white space and comments: what remains of a text
/// when formatting does not count.
pub(super) fn tokens(text: &str) -> Vec<Token<'_>> {
    let bytes = text.as_bytes();
    let mut tokens = Vec::new();
    let mut i = 0;
    while i < bytes.len() {
        let start = i;
        let rest = &text[i..];
        match bytes[i] {
            b if b.is_ascii_whitespace() => {
                i += 1;
                continue;
            }
            b'/' if rest.starts_with("//") => {
                i += rest.find('\n').unwrap_or(rest.len());
                continue;
            }
            b'/' if rest.starts_with("/*") => {
                i += block_comment(rest);
                continue;
            }
            quote @ (b'"' | b'`' | b'\'') => i += string(rest, quote),
            b if b.is_ascii_alphanumeric() || b == b'_' => {
                // Numbers and words alike; a dot or an exponent's sign splits a number into
                // several tokens, which is as good.
                i += rest
                    .find(|c: char| !(c.is_ascii_alphanumeric() || c == '_'))
                    .unwrap_or(rest.len());
            }
            _ => i += rest.chars().next().map_or(1, char::len_utf8),
        }
        tokens.push(Token { start, text: &text[start..i] });
    }
    tokens
}

/// A token and where it starts, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Token<'a> {
    pub(super) start: usize,
    pub(super) text: &'a str,
}

/// Length of the (nestable) block comment at the start of `text`.
fn block_comment(text: &str) -> usize {
    let (mut depth, mut i) = (0usize, 0);
    while i < text.len() {
        if text[i..].starts_with("/*") {
            depth += 1;
            i += 2;
        } else if text[i..].starts_with("*/") {
            depth -= 1;
            i += 2;
            if depth == 0 {
                return i;
            }
        } else {
            i += text[i..].chars().next().map_or(1, char::len_utf8);
        }
    }
    i
}

/// Length of the string literal at the start of `text`, with its quotes. A backtick string ends at
/// the first backtick outside its `${…}` parts.
fn string(text: &str, quote: u8) -> usize {
    let bytes = text.as_bytes();
    let (mut i, mut depth) = (1, 0usize);
    while i < bytes.len() {
        match bytes[i] {
            b'\\' if quote != b'`' => i += 1,
            b'$' if quote == b'`' && bytes.get(i + 1) == Some(&b'{') => {
                depth += 1;
                i += 1;
            }
            b'}' if depth > 0 => depth -= 1,
            b if b == quote && depth == 0 => return i + 1,
            _ => {}
        }
        i += 1;
    }
    text.len()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn imports_stay_inside_the_folder() {
        assert_eq!(resolve_import(None, "lib/a").unwrap(), "lib/a.rhai");
        assert_eq!(resolve_import(Some("lib/a.rhai"), "b.rhai").unwrap(), "lib/b.rhai");
        assert_eq!(resolve_import(Some("lib/a.rhai"), "../c").unwrap(), "c.rhai");
        for bad in ["../x", "/etc/passwd", "lib/../../x", "C:x", "a\\b"] {
            assert!(resolve_import(None, bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_snapshot_has_the_script_and_all_its_imports() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = dir.path().join(name);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(&path, text).unwrap();
            path
        };
        let script = write("s.rhai", "import \"lib/a\" as a; // import \"no\" as no\nlet x = 1;");
        // In a circle, and one that is not there.
        write("lib/a.rhai", "import `b` as b; import \"../s\" as s; import \"../../out\" as o;");
        let seen = snapshot(&script);
        let names: Vec<_> = seen.keys().map(|p| p.strip_prefix(dir.path()).unwrap()).collect();
        assert_eq!(names, [Path::new("lib/a.rhai"), Path::new("lib/b.rhai"), Path::new("s.rhai")]);
        assert!(seen[&dir.path().join("lib/b.rhai")].is_none());
        write("lib/b.rhai", "1");
        assert_ne!(snapshot(&script), seen);
        std::fs::remove_file(&script).unwrap();
        assert_eq!(snapshot(&script), Snapshot::from([(script, None)]));
    }

    #[test]
    fn formatting_and_comments_leave_no_trace() {
        let texts = |s: &'static str| tokens(s).iter().map(|t| t.text).collect::<Vec<_>>();
        assert_eq!(
            texts("fn f(s) { // note\n  s.x /* a /* b */ c */ * 2.0 }"),
            texts("fn f(s){s.x*2.0}")
        );
        assert_eq!(texts("`a ${x + `b`} // c`"), ["`a ${x + `b`} // c`"]);
        assert_eq!(texts(r#""a \" // b" + 'x'"#), [r#""a \" // b""#, "+", "'x'"]);
        assert_ne!(texts("s.x + 1"), texts("s.x + 2"));
    }
}
