//! Commands in the documentation and in the help are commands that exist.

use std::path::{Path, PathBuf};

use clap::{CommandFactory, Parser};

use crate::args::Cli;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Lines of the `sh` blocks of a text, with what is continued joined.
fn shell_lines(markdown: &str) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let (mut inside, mut continued) = (false, false);
    for line in markdown.lines() {
        if line.starts_with("```") {
            inside = line.trim_end() == "```sh";
            continue;
        }
        if !inside {
            continue;
        }
        match lines.last_mut().filter(|_| continued) {
            Some(last) => *last += line.trim_end_matches('\\'),
            None => lines.push(line.trim_end_matches('\\').to_string()),
        }
        continued = line.ends_with('\\');
    }
    lines
}

/// Words of the simple commands of a line, as a shell splits them: quotes, comments, `&&`, `||`, `|`, `;` and `>`.
fn commands(line: &str) -> Vec<Vec<String>> {
    let mut commands = vec![Vec::new()];
    let (mut word, mut quote, mut begun) = (String::new(), None, false);
    for c in line.chars() {
        match (quote, c) {
            (Some(q), c) if c == q => quote = None,
            (Some(_), c) => word.push(c),
            (None, '\'' | '"') => (quote, begun) = (Some(c), true),
            (None, ' ' | '|' | '&' | ';' | '>') => {
                if begun {
                    commands.last_mut().unwrap().push(std::mem::take(&mut word));
                    begun = false;
                }
                if c != ' ' {
                    commands.push(Vec::new());
                }
            }
            (None, '#') if !begun => break,
            (None, c) => {
                word.push(c);
                begun = true;
            }
        }
    }
    if begun {
        commands.last_mut().unwrap().push(word);
    }
    commands.retain(|words| !words.is_empty());
    commands
}

/// The words of this program's own commands in a line, the program's name first.
fn own_commands(line: &str) -> Vec<Vec<String>> {
    let own = |words: Vec<String>| {
        if words[0] == "anisobond" {
            return Some(words);
        }
        let after =
            words.iter().position(|w| w == "--").filter(|_| words.starts_with(&["cargo".into(), "run".into()]))?;
        Some([&["anisobond".to_string()], &words[after + 1..]].concat())
    };
    commands(line).into_iter().filter_map(own).collect()
}

/// Refuses words that the command line does not understand, and files of the repository that are not there.
fn check(words: &[String]) -> Result<(), String> {
    if let Err(error) = Cli::try_parse_from(words)
        && error.use_stderr()
    {
        return Err(error.to_string());
    }
    match words.iter().find(|w| w.starts_with("cases/") && !root().join(w).exists()) {
        Some(missing) => Err(format!("{missing} is not there")),
        None => Ok(()),
    }
}

#[test]
fn commands_of_the_documentation_exist() {
    let mut count = 0;
    for folder in [root(), root().join("docs")] {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "md") {
                continue;
            }
            let text = std::fs::read_to_string(&path).unwrap();
            for line in shell_lines(&text) {
                for words in own_commands(&line) {
                    count += 1;
                    check(&words).unwrap_or_else(|why| panic!("{}: {line}\n{why}", path.display()));
                }
            }
        }
    }
    assert!(count > 60, "{count} commands");
}

#[test]
fn commands_of_the_help_exist() {
    let mut count = 0;
    for command in Cli::command().get_subcommands() {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        for line in help.lines().map(str::trim).filter(|l| l.starts_with("anisobond ")) {
            for words in own_commands(line) {
                count += 1;
                check(&words).unwrap_or_else(|why| panic!("{}: {line}\n{why}", command.get_name()));
            }
        }
    }
    assert!(count > 30, "{count} commands");
}

#[test]
fn what_does_not_exist_is_seen() {
    let refused = |line: &str| own_commands(line).iter().any(|words| check(words).is_err());
    assert!(refused("cd there && anisobond calibrate KIO3 --horizn 3"));
    assert!(refused("anisobond run cases/no-such-case.toml"));
    assert!(!refused("anisobond calibrate KIO3 --spacing '2 mm' -o a || echo $?   # --horizn"));
    assert_eq!(own_commands("cargo run --release -- tensor Si | less")[0], ["anisobond", "tensor", "Si"]);
}
