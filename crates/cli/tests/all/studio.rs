//! The studio's server as a browser, and as others, meet it.

use crate::common;

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{folder, refused, stdout};
use serde_json::{Value, json};

/// A studio that runs.
pub struct Studio {
    child: Child,
    port: u16,
    token: String,
}

impl Studio {
    pub fn start(args: &[&str]) -> Self {
        Studio::started_by(Command::new(env!("CARGO_BIN_EXE_anisobond")).arg("studio").args(args))
    }

    fn started_by(command: &mut Command) -> Self {
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let (port, token) = line.trim().strip_prefix("http://127.0.0.1:").unwrap().split_once('/').unwrap();
        Studio { child, port: port.parse().unwrap(), token: token.trim_end_matches('/').into() }
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// What comes back for bytes that are sent as they are: status, whole head, body.
    fn raw(&self, bytes: &[u8]) -> (u16, String, Vec<u8>) {
        let mut stream = self.connect();
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).unwrap();
        let end = answer.windows(4).position(|w| w == b"\r\n\r\n").expect("an answer");
        let head = String::from_utf8(answer[..end].to_vec()).unwrap();
        (head.split(' ').nth(1).unwrap().parse().unwrap(), head, answer[end + 4..].to_vec())
    }

    /// A request with the right host; more header lines end with \r\n.
    fn request(&self, method: &str, target: &str, more: &str, body: &[u8]) -> (u16, String, Vec<u8>) {
        let length = if method == "POST" { format!("Content-Length: {}\r\n", body.len()) } else { String::new() };
        let head = format!("{method} {target} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n{length}{more}\r\n", self.port);
        self.raw(&[head.as_bytes(), body].concat())
    }

    fn get(&self, path: &str) -> (u16, String, Vec<u8>) {
        self.request("GET", &format!("/{}/{path}", self.token), "", b"")
    }

    pub fn post(&self, path: &str, question: &Value) -> Value {
        let body = question.to_string();
        let target = format!("/{}/{path}", self.token);
        let (status, _, answer) = self.request("POST", &target, "Content-Type: application/json\r\n", body.as_bytes());
        assert_eq!(status, 200, "{}", String::from_utf8_lossy(&answer));
        serde_json::from_slice(&answer).unwrap()
    }

    fn status(&self, method: &str, target: &str, more: &str, body: &[u8]) -> u16 {
        self.request(method, target, more, body).0
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

pub fn question(material: Value, flags: Value) -> Value {
    json!({ "material": material, "class": "", "flags": flags, "rotate": [] })
}

#[test]
fn a_typed_tensor_is_calibrated_and_taken_away() {
    let folder = folder();
    let out = folder.path().join("mine");
    let studio = Studio::start(&["-o", out.to_str().unwrap()]);
    let (status, head, page) = studio.get("");
    let page = String::from_utf8(page).unwrap();
    assert!(status == 200 && page.contains("<form id=\"form\"") && page.contains("calibrate"));
    assert!(
        ["Content-Security-Policy: default-src 'none'", "no-store", "nosniff", "no-referrer"]
            .iter()
            .all(|h| head.contains(h))
    );
    assert!(!page.contains("http://127") && page.split("https://").count() == 1, "a page that fetches");

    let text = "name = \"my salt\"\nunit = \"GPa\"\nclass = \"cubic\"\nc11 = 49\nc12 = 13\nc44 = 13\n";
    let asked = question(json!({ "text": text }), json!({ "horizon": "3", "spacing": "2 mm", "model": "hybrid" }));
    let answer = studio.post("calibrate", &asked);
    assert_eq!((answer["page"]["title"].as_str(), answer["no_case"].as_str()), (Some("my salt"), None));
    assert_eq!(answer["command"], "anisobond calibrate material.toml --horizon 3 --spacing '2 mm' --model hybrid");
    assert_eq!(answer["page"]["tensors"][0]["voigt"][0][0], 49e9);
    let id = answer["id"].as_u64().unwrap();
    let file = |name: &str| studio.get(&format!("file/{id}/{name}"));

    // The same as the command line's, byte by byte.
    let own = common::write(&folder, "own.toml", text);
    let dir = folder.path().join("cli").display().to_string();
    stdout(&["calibrate", &own, "--horizon", "3", "--spacing", "2 mm", "--model", "hybrid", "-o", &dir]);
    for name in ["bonds.csv", "calibration.json", "neighbourhood.vtp", "neighbourhood.svg"] {
        let (status, head, bytes) = file(name);
        assert!(status == 200 && head.contains("Content-Disposition: attachment"), "{name}: {head}");
        assert!(bytes == std::fs::read(folder.path().join("cli").join(name)).unwrap(), "{name} differs");
    }
    // The case is one that can be run; the material is the tensor.
    let case = common::write(&folder, "case.toml", std::str::from_utf8(&file("case.toml").2).unwrap());
    let plan = common::json(&["check", &case, "--json"]);
    assert_eq!(plan["nodes"].as_u64(), Some(36 * 12 * 12), "{plan}");
    let material = common::write(&folder, "material.toml", std::str::from_utf8(&file("material.toml").2).unwrap());
    let read =
        common::json(&["calibrate", &material, "--horizon", "3", "--spacing", "2 mm", "--model", "hybrid", "--json"]);
    assert_eq!(read["target"], answer["page"]["tensors"][0]["voigt"]);
    assert!(String::from_utf8(file("report.html").2).unwrap().contains("my salt"));

    // Nothing was written until now, and then below the folder only.
    assert_eq!(std::fs::read_dir(&out).unwrap().count(), 0);
    let saved = studio.post("save", &json!({ "id": id }));
    let at = out.join("my-salt-hybrid");
    assert_eq!(saved["folder"].as_str(), at.to_str());
    for name in ["bonds.csv", "calibration.json", "case.toml", "material.toml", "report.html", "neighbourhood.png"] {
        assert!(at.join(name).is_file(), "{name}");
    }
    assert!(studio.post("save", &json!({ "id": 99 }))["error"].as_str().unwrap().contains("no longer kept"));
}

#[test]
fn wrong_input_says_what_the_command_line_says() {
    let studio = Studio::start(&[]);
    let error = |asked: &Value| {
        let answer = studio.post("calibrate", asked);
        assert_eq!(answer["kind"], "input");
        answer["error"].as_str().expect("an error").to_string()
    };
    let said = |args: &[&str]| refused(args, 2).trim().trim_start_matches("anisobond: ").to_string();
    let name = |name: &str| json!({ "name": name });
    assert_eq!(error(&question(name("KI03"), json!({}))), said(&["calibrate", "KI03"]));
    for (flag, value) in
        [("horizon", "six"), ("horizon", "-1"), ("lower-bound", "lots"), ("spacing", "2 kg"), ("horizon", "0.5")]
    {
        let own = said(&["calibrate", "Si", &format!("--{flag}={value}")]);
        assert_eq!(error(&question(name("Si"), json!({ flag: value }))), own);
    }
    let both = json!({ "model": "hybrid", "lower-bound": "1" });
    assert_eq!(error(&question(name("Si"), both)), said(&["calibrate", "Si", "--model=hybrid", "--lower-bound=1"]));
    let turned = json!({ "material": name("Si"), "flags": {}, "rotate": ["bunge:1,2"] });
    assert_eq!(error(&turned), said(&["calibrate", "Si", "--rotate=bunge:1,2"]));
    let folder = folder();
    let text = "unit = \"GPa\"\nclass = \"cubic\"\nc11 = 49\nc12 = 13\n";
    let path = common::write(&folder, "material.toml", text);
    let own = said(&["calibrate", &path]).replace(&path, "material.toml");
    assert_eq!(error(&question(json!({ "text": text }), json!({}))), own);
    assert!(own.contains("c44"), "{own}");
    // Files of this computer are not read, whatever the form says; long work belongs elsewhere.
    assert!(error(&question(name("/etc/passwd"), json!({}))).contains("neither a file nor"));
    assert!(error(&question(name("Si"), json!({ "influence": "/etc/passwd" }))).contains("command line only"));
    assert!(error(&question(name("Si"), json!({ "output": "/tmp" }))).contains("not of the studio"));
    assert!(error(&question(name("Si"), json!({ "horizon": "100" }))).contains("smaller horizon"));
    let projected = json!({ "material": name("Te2W"), "class": "cubic", "flags": { "horizon": "2", "shape": "cube" } });
    let answer = studio.post("calibrate", &projected);
    assert_eq!(answer["page"]["title"], "Te2W, closest cubic");
    assert!(answer["no_case"].as_str().unwrap().contains("spherical"));
    let names: Vec<&str> = answer["files"].as_array().unwrap().iter().map(|f| f["name"].as_str().unwrap()).collect();
    assert!(names.contains(&"bonds.csv") && !names.contains(&"case.toml"));
    assert_eq!(studio.get(&format!("file/{}/case.toml", answer["id"])).0, 404);
    assert!(studio.post("save", &json!({ "id": answer["id"] }))["error"].as_str().unwrap().contains("-o DIR"));
}

#[test]
fn others_are_refused() {
    let studio = Studio::start(&[]);
    let (port, page) = (studio.port, format!("/{}/", studio.token));
    assert_eq!(studio.status("GET", &page, "Origin: http://127.0.0.1:1\r\n", b""), 403);
    assert_eq!(studio.status("GET", &page, "Origin: null\r\n", b""), 403);
    assert_eq!(studio.status("GET", &page, "Sec-Fetch-Site: cross-site\r\n", b""), 403);
    assert_eq!(studio.status("GET", &page, &format!("Origin: http://localhost:{port}\r\n"), b""), 200);
    // Another name for this address: what a page that rebinds its own name would send.
    for host in ["evil.example", "127.0.0.1", "127.0.0.1:1", "[::1]:80", ""] {
        let request = format!("GET {page} HTTP/1.1\r\nHost: {host}\r\n\r\n");
        assert_eq!(studio.raw(request.as_bytes()).0, 403, "{host}");
    }
    assert_eq!(studio.raw(format!("GET {page} HTTP/1.1\r\n\r\n").as_bytes()).0, 403);
    // Without the secret nothing is there, whatever is asked for.
    let wrong = "0".repeat(32);
    for target in [
        "/",
        "/favicon.ico",
        &format!("/{wrong}/"),
        &format!("/{wrong}/calibrate"),
        &format!("/{}", &studio.token[..31]),
    ] {
        assert_eq!(studio.status("GET", target, "", b""), 404, "{target}");
    }
    let (status, head, _) = studio.request("GET", &format!("/{}", studio.token), "", b"");
    assert!(status == 308 && head.contains(&format!("Location: /{}/", studio.token)));
    // Files are those of an answer, by their names; there are no paths.
    studio.post("calibrate", &question(json!({ "name": "Si" }), json!({ "horizon": "2" })));
    assert_eq!(studio.get("file/1/bonds.csv").0, 200);
    for path in [
        "file/1/../../../etc/passwd",
        "file/1/..%2f..%2fetc%2fpasswd",
        "file/1//etc/passwd",
        "file/../bonds.csv",
        "file/2/bonds.csv",
        "file/1/",
        "file/1",
        "../../etc/passwd",
        "file/-1/bonds.csv",
    ] {
        assert_eq!(studio.get(path).0, 404, "{path}");
    }
}

#[test]
fn requests_that_are_none_are_refused() {
    let studio = Studio::start(&[]);
    let host = format!("Host: 127.0.0.1:{}\r\n", studio.port);
    let ask = format!("/{}/calibrate", studio.token);
    let json = "Content-Type: application/json\r\n";
    assert_eq!(studio.status("POST", &ask, json, b"{"), 400);
    assert_eq!(studio.status("POST", &ask, json, b"{\"material\":{\"name\":\"Si\"},\"flags\":{},\"more\":1}"), 400);
    assert_eq!(studio.status("POST", &ask, json, &[0xff, 0xfe]), 400);
    assert_eq!(studio.status("POST", &ask, "Content-Type: text/plain\r\n", b"{}"), 415);
    assert_eq!(studio.status("POST", &ask, "", b"{}"), 415);
    assert_eq!(studio.status("PUT", &ask, "", b""), 405);
    let raw = |text: String| studio.raw(text.as_bytes()).0;
    assert_eq!(raw(format!("POST {ask} HTTP/1.1\r\n{host}{json}\r\n")), 411);
    for length in ["-1", "x", "1e3", "+5", " "] {
        assert_eq!(
            raw(format!("POST {ask} HTTP/1.1\r\n{host}{json}Content-Length: {length}\r\n\r\n")),
            400,
            "{length}"
        );
    }
    for length in ["262145", "99999999999999999999999999"] {
        assert_eq!(raw(format!("POST {ask} HTTP/1.1\r\n{host}{json}Content-Length: {length}\r\n\r\n")), 413);
    }
    assert_eq!(studio.request("POST", &ask, json, &vec![b' '; 300_000]).0, 413);
    assert_eq!(raw(format!("POST {ask} HTTP/1.1\r\n{host}{json}Transfer-Encoding: chunked\r\n\r\n0\r\n\r\n")), 501);
    assert_eq!(raw(format!("GET / HTTP/1.1\r\n{host}X: {}\r\n\r\n", "a".repeat(20_000))), 431);
    assert_eq!(raw(format!("GET / HTTP/1.1\r\n{host}{host}\r\n")), 400);
    assert_eq!(raw(format!("GET / HTTP/2.0\r\n{host}\r\n")), 505);
    for line in ["", "GET", "GET / ", "get / HTTP/1.1", "GET http://x/ HTTP/1.1", "GET  / HTTP/1.1"] {
        let status = raw(format!("{line}\r\n{host}\r\n"));
        assert!(matches!(status, 400 | 505), "{line}: {status}");
    }
    assert_eq!(raw(format!("GET / HTTP/1.1\r\n{host}no colon\r\n\r\n")), 400);
    assert_eq!(studio.raw(b"\x16\x03\x01\x02\x00\x01\x00\r\n\r\n").0, 400);
    // Connections that say nothing do not keep others from being answered; too many are turned away.
    let silent: Vec<TcpStream> = (0..20).map(|_| studio.connect()).collect();
    let start = Instant::now();
    assert_eq!(studio.get("").0, 200);
    assert!(start.elapsed() < Duration::from_secs(5));
    let many: Vec<TcpStream> = (0..40).map(|_| studio.connect()).collect();
    let mut last = many.last().unwrap();
    let mut answer = String::new();
    last.read_to_string(&mut answer).unwrap();
    assert!(answer.starts_with("HTTP/1.1 503"), "{answer}");
    // Together until now: places that some give back while others come would let the last in.
    drop((silent, many));
    let open_again = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        studio.get("").0 == 200
    });
    assert!(open_again);
}

#[test]
fn ports_are_free_or_refused_and_the_studio_ends() {
    let first = Studio::start(&[]);
    let second = Studio::start(&[]);
    assert!(first.port != second.port && first.token != second.token && first.token.len() == 32);
    let message = refused(&["studio", "--port", &first.port.to_string()], 2);
    assert!(message.contains("--port") && message.contains("leave it out"), "{message}");
    assert!(refused(&["studio", "--port", "0"], 2).contains("--port"));
    #[cfg(unix)]
    {
        let mut first = first;
        let id = first.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        assert!(first.child.wait().unwrap().success(), "Ctrl-C is how it ends");
    }
}

/// The browser is given a file that its owner alone can read, once; the studio answers while the browser starts.
#[cfg(target_os = "linux")]
#[test]
fn the_secret_is_on_no_command_line() {
    use std::os::unix::fs::PermissionsExt;
    let dir = folder();
    let (starter, words) = (dir.path().join("xdg-open"), dir.path().join("words"));
    // A browser that takes long to start.
    std::fs::write(
        &starter,
        format!("#!/bin/sh\necho \"$@\" > {}.new\nmv {0}.new {0}\nexec sleep 30\n", words.display()),
    )
    .unwrap();
    std::fs::set_permissions(&starter, std::fs::Permissions::from_mode(0o755)).unwrap();
    let path = format!("{}:{}", dir.path().display(), std::env::var("PATH").unwrap());
    let program = env!("CARGO_BIN_EXE_anisobond");
    let studio = Studio::started_by(Command::new(program).args(["studio", "--open"]).env("PATH", path));
    while !words.exists() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let given = std::fs::read_to_string(&words).unwrap();
    assert!(!given.contains(&studio.token), "{given}");
    let page = std::path::Path::new(given.trim());
    assert_eq!(std::fs::metadata(page).unwrap().permissions().mode() & 0o777, 0o600);
    let address = format!("http://127.0.0.1:{}/{}/", studio.port, studio.token);
    assert!(std::fs::read_to_string(page).unwrap().contains(&address));
    // As a browser comes from a file; another page's script does not get in this way.
    let (target, from) = (format!("/{}/", studio.token), "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: ");
    assert_eq!(studio.status("GET", &target, &format!("{from}cors\r\nSec-Fetch-Dest: empty\r\n"), b""), 403);
    assert!(page.exists());
    assert_eq!(studio.status("GET", &target, &format!("{from}navigate\r\nSec-Fetch-Dest: document\r\n"), b""), 200);
    assert!(!page.exists(), "once");
}
