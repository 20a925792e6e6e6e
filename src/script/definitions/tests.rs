use super::*;

fn file(path: &str) -> String {
    files().into_iter().find(|f| f.path == path).expect("it is there").text
}
