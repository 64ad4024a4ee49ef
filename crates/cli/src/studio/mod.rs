//! `anisobond studio`: a form and the page of a calibration, served to a browser on this computer.
//!
//! Only this computer can reach it; a page of another origin cannot, because the URL holds a secret and the Host and Origin
//! of every request are looked at. Nothing is written but by the button that saves, below the folder that was named.

mod http;
mod question;
mod worker;

use std::collections::VecDeque;
use std::io::Write;
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use anisobond::tensor::{Material, SymmetryClass};
use anisobond::{Error, Result};
use anisobond_app::studio_page;
use serde::Deserialize;
use serde_json::json;

use self::http::{Request, Response};
use self::question::{Answer, Question};
use self::worker::Worker;
use crate::{Ending, args, folder, text};

/// Answers whose files can still be taken.
const MOST_KEPT: usize = 4;

/// What a browser lets the page do: its own scripts and styles, and questions to this server.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; \
                      connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'";

static STOP: AtomicBool = AtomicBool::new(false);

pub fn run(args: &args::Studio) -> Result<Ending> {
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).map_err(|e| Error::file("create", folder, e))?;
    }
    let listener = listen(args.port)?;
    let address = listener.local_addr().map_err(|e| Error::file("open", "the port", e))?;
    let studio = Studio::new(address.port(), args.output.clone())?;
    // Ctrl-C, or a request to terminate: the connection wakes the loop, which sees the flag.
    let _ = ctrlc::set_handler(move || {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        // On a thread of its own, so that a second one is heard whatever becomes of this.
        std::thread::spawn(move || TcpStream::connect(address));
    });
    let url = format!("http://127.0.0.1:{}/{}/", address.port(), studio.token);
    text::print(&format!("{url}\n"))?;
    eprintln!("open it in a browser on this computer; Ctrl-C ends the studio");
    let opening = args.open.then(|| Opening::new(&url)).transpose()?.map(Arc::new);
    // The browser is started beside the server, which answers it meanwhile.
    if let Some(opening) = opening.clone() {
        std::thread::spawn(move || {
            if !opening.start() {
                eprintln!("no browser could be started: open the address above by hand");
            }
        });
    }
    let asked = opening.clone();
    http::serve(&listener, &STOP, move |request| {
        let response = studio.respond(request);
        if let (200, Some(opening)) = (response.status, &asked) {
            opening.done();
        }
        response
    });
    if let Some(opening) = opening {
        opening.done();
    }
    eprintln!("ended");
    Ok(Ending::Done)
}

fn listen(port: Option<u16>) -> Result<TcpListener> {
    let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port.unwrap_or(0)));
    TcpListener::bind(address).map_err(|e| match port {
        Some(port) => Error::input(format!("--port {port}: {e}"), "give another, or leave it out"),
        None => Error::file("open", "a port", e),
    })
}

/// A file that leads a browser to the address, once. Everybody on the computer sees the words with which a program is started,
/// so the secret is not among them: the browser is given the file, which its owner alone can read.
struct Opening(Mutex<Option<tempfile::NamedTempFile>>, PathBuf);

impl Opening {
    fn new(url: &str) -> Result<Self> {
        let failed = |e| Error::file("write", "a page for the browser", e);
        // For its owner alone, as all of these files are.
        let mut file = tempfile::Builder::new().prefix("anisobond-").suffix(".html").tempfile().map_err(failed)?;
        let page = format!(
            "<!doctype html><meta charset=\"utf-8\"><meta name=\"referrer\" content=\"no-referrer\">\
             <meta http-equiv=\"refresh\" content=\"0; url={url}\"><a href=\"{url}\">anisobond studio</a>\n"
        );
        file.write_all(page.as_bytes()).and_then(|()| file.flush()).map_err(failed)?;
        let path = file.path().to_path_buf();
        Ok(Opening(Mutex::new(Some(file)), path))
    }

    /// Whether a browser was started with it; returns when its starter has ended.
    fn start(&self) -> bool {
        opened(&self.1)
    }

    /// The file is not needed any more.
    fn done(&self) {
        drop(self.0.lock().unwrap_or_else(PoisonError::into_inner).take());
    }
}

/// Whether a browser was started.
fn opened(page: &Path) -> bool {
    let (program, first): (_, &[&str]) = match std::env::consts::OS {
        "macos" => ("open", &[]),
        "windows" => ("rundll32", &["url.dll,FileProtocolHandler"]),
        _ => ("xdg-open", &[]),
    };
    let quiet = std::process::Stdio::null;
    let mut command = std::process::Command::new(program);
    command.args(first).arg(page).stdin(quiet()).stdout(quiet()).stderr(quiet());
    command.status().is_ok_and(|status| status.success())
}

/// The server's state.
struct Studio {
    port: u16,
    token: String,
    /// Where the button saves.
    folder: Option<PathBuf>,
    page: String,
    worker: Arc<Worker<Question, Result<Answer>>>,
    kept: Mutex<Kept>,
}

/// The last answers, with their numbers.
#[derive(Default)]
struct Kept {
    count: u64,
    answers: VecDeque<(u64, Arc<Answer>)>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Save {
    id: u64,
    /// Whether another calibration in the folder is replaced.
    #[serde(default)]
    replace: bool,
}

impl Studio {
    fn new(port: u16, folder: Option<PathBuf>) -> Result<Self> {
        let mut secret = [0; 16];
        getrandom::fill(&mut secret).map_err(|e| Error::input(format!("no random numbers: {e}"), "try again"))?;
        let start = json!({
            "version": env!("CARGO_PKG_VERSION"),
            "materials": Material::builtin_names(),
            "classes": SymmetryClass::ALL.map(SymmetryClass::name).into_iter().filter(|n| *n != "triclinic").collect::<Vec<_>>(),
            "folder": folder.as_ref().map(|f| f.display().to_string()),
        });
        Ok(Studio {
            port,
            token: secret.iter().map(|b| format!("{b:02x}")).collect(),
            folder,
            page: studio_page(&start),
            worker: Worker::start(|question: Question| question.answer())
                .map_err(|e| Error::file("start", "a thread", e))?,
            kept: Mutex::default(),
        })
    }

    fn respond(&self, request: &Request) -> Response {
        if let Some(refusal) = self.refusal(request) {
            return refusal;
        }
        let Some(path) = request.target.strip_prefix('/').and_then(|t| t.strip_prefix(self.token.as_str())) else {
            return Response::refusal(404, "use the whole address that the studio printed");
        };
        match (request.method.as_str(), path) {
            ("GET", "") => Response { status: 308, ..Response::new("text/plain", "") }
                .with("Location", format!("/{}/", self.token)),
            ("GET", "/") => {
                Response::new("text/html; charset=utf-8", self.page.as_str()).with("Content-Security-Policy", POLICY)
            }
            ("POST", "/calibrate") => body(request, |question| self.calibrate(question)),
            ("POST", "/save") => body(request, |save: Save| self.save(&save)),
            ("GET", path) => match path.strip_prefix("/file/").and_then(|rest| rest.split_once('/')) {
                Some((id, name)) => self.file(id, name),
                None => Response::refusal(404, "nothing is here"),
            },
            _ => Response::refusal(405, "GET and POST only"),
        }
    }

    /// Whoever calls this server by another name, or from another page, is refused.
    fn refusal(&self, request: &Request) -> Option<Response> {
        let names = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", self.port));
        let host = request.header("host").is_some_and(|h| names.iter().any(|n| n == h));
        let own = |o: &str| names.iter().any(|n| o == format!("http://{n}"));
        let same = |s: &str| matches!(s, "same-origin" | "none");
        // The file that led the browser here is of no origin; who comes to read the page has to know its secret.
        let arrives = request.method == "GET"
            && request.header("sec-fetch-mode").is_some_and(|mode| mode == "navigate")
            && request.header("sec-fetch-dest").is_some_and(|dest| dest == "document")
            && request.target == format!("/{}/", self.token);
        let site = arrives || request.header("sec-fetch-site").is_none_or(same);
        if host && request.header("origin").is_none_or(own) && site {
            return None;
        }
        Some(Response::refusal(403, "use the address that the studio printed"))
    }

    fn calibrate(&self, question: Question) -> String {
        let answer = match self.worker.ask(question) {
            None => return json!({ "superseded": true }).to_string(),
            Some(Err(error)) => return refusal(&error).to_string(),
            Some(Ok(answer)) => Arc::new(answer),
        };
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.count += 1;
        let id = kept.count;
        kept.answers.push_back((id, Arc::clone(&answer)));
        if kept.answers.len() > MOST_KEPT {
            kept.answers.pop_front();
        }
        drop(kept);
        answer.json(id)
    }

    fn answer(&self, id: u64) -> Option<Arc<Answer>> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.answers.iter().find(|(own, _)| *own == id).map(|(_, answer)| Arc::clone(answer))
    }

    fn file(&self, id: &str, name: &str) -> Response {
        let Some(answer) = id.parse().ok().and_then(|id| self.answer(id)) else {
            return Response::refusal(404, "this calibration is no longer kept: change something in the form");
        };
        match answer.file(name) {
            Ok(Some(bytes)) => Response::new("application/octet-stream", bytes)
                .with("Content-Disposition", "attachment")
                .with("Content-Security-Policy", "sandbox"),
            Ok(None) => Response::refusal(404, "no such file"),
            Err(error) => Response::refusal(400, &text::sentence(&error)),
        }
    }

    fn save(&self, save: &Save) -> String {
        let saved = || {
            let folder =
                self.folder.as_ref().ok_or_else(|| Error::input("no folder was named", "start with -o DIR"))?;
            let answer =
                self.answer(save.id).ok_or_else(|| Error::input("it is no longer kept", "change something"))?;
            let own = folder.join(folder_name(&answer.done.material.name, answer.done.result.model().name()));
            folder::write(&own, &answer.files()?, save.replace)?;
            Ok(own)
        };
        match saved() {
            Ok(own) => json!({ "folder": Path::display(&own).to_string() }),
            Err(error) => {
                let mut said = refusal(&error);
                said["others"] = holds_others(&error).into();
                said
            }
        }
        .to_string()
    }
}

/// An error as JSON: its sentence, and its kind for programs.
fn refusal(error: &Error) -> serde_json::Value {
    json!({ "error": text::sentence(error), "kind": error.kind().name() })
}

/// Whether a folder was refused for the results that it holds.
fn holds_others(error: &Error) -> bool {
    matches!(error, Error::Failure { remedy, .. } if remedy.names("force"))
}

/// A folder's name of letters, digits and dashes.
fn folder_name(material: &str, model: &str) -> String {
    let words: String = material.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(60).collect();
    let words: Vec<&str> = words.split('-').filter(|w| !w.is_empty()).collect();
    [words.join("-").as_str(), model].iter().filter(|w| !w.is_empty()).copied().collect::<Vec<_>>().join("-")
}

/// A JSON body, and the JSON of what is made of it.
fn body<T: serde::de::DeserializeOwned>(request: &Request, of: impl FnOnce(T) -> String) -> Response {
    let json = request
        .header("content-type")
        .is_some_and(|t| t.split(';').next().is_some_and(|t| t.trim() == "application/json"));
    if !json {
        return Response::refusal(415, "send application/json");
    }
    match serde_json::from_slice(&request.body) {
        Ok(value) => Response::new("application/json", of(value)),
        Err(e) => Response::refusal(400, &format!("not what the form sends: {e}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_folders_cannot_leave_theirs() {
        assert_eq!(folder_name("KIO3", "central"), "KIO3-central");
        assert_eq!(folder_name("../../etc/passwd", "hybrid"), "etc-passwd-hybrid");
        assert_eq!(folder_name("/", "hybrid"), "hybrid");
        assert_eq!(folder_name("Šmilauer's rock, closest cubic", "central"), "milauer-s-rock-closest-cubic-central");
    }
}
