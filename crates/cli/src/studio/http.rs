//! As much of HTTP/1.1 as one browser on this computer needs: one request per connection, everything bounded.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Bytes of a request's first line and headers.
const MOST_HEAD: usize = 16 * 1024;

/// Bytes of a request's body.
pub const MOST_BODY: usize = 256 * 1024;

/// Time for a request to arrive whole, and for an answer to be taken.
const PATIENCE: Duration = Duration::from_secs(10);

/// Connections at a time.
const MOST_CONNECTIONS: usize = 32;

/// A request as it came.
pub struct Request {
    pub method: String,
    /// The path with whatever follows it, as sent.
    pub target: String,
    headers: Vec<(String, String)>,
    pub body: Vec<u8>,
}

impl Request {
    /// The value of a header; its name in small letters.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(own, _)| own == name).map(|(_, value)| value.as_str())
    }
}

/// What is sent back.
pub struct Response {
    pub status: u16,
    /// Its media type.
    pub kind: &'static str,
    /// Further headers.
    pub headers: Vec<(&'static str, String)>,
    pub body: Vec<u8>,
}

impl Response {
    pub fn new(kind: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Response { status: 200, kind, headers: Vec::new(), body: body.into() }
    }

    /// A refusal with its reason.
    pub fn refusal(status: u16, reason: &str) -> Self {
        Response { status, ..Response::new("text/plain; charset=utf-8", format!("{reason}\n")) }
    }

    pub fn with(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.headers.push((name, value.into()));
        self
    }

    fn bytes(&self) -> Vec<u8> {
        let mut head = format!(
            "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
             X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n",
            self.status,
            reason(self.status),
            self.kind,
            self.body.len()
        );
        for (name, value) in &self.headers {
            head += &format!("{name}: {value}\r\n");
        }
        [(head + "\r\n").as_bytes(), &self.body].concat()
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        308 => "Permanent Redirect",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        411 => "Length Required",
        413 => "Content Too Large",
        415 => "Unsupported Media Type",
        431 => "Request Header Fields Too Large",
        501 => "Not Implemented",
        505 => "HTTP Version Not Supported",
        _ => "Service Unavailable",
    }
}

/// Answers requests, each on a thread of its own, until `stop` is set and one more connection is made.
pub fn serve(listener: &TcpListener, stop: &AtomicBool, answer: impl Fn(&Request) -> Response + Send + Sync + 'static) {
    let answer = Arc::new(answer);
    let open = Arc::new(AtomicUsize::new(0));
    for stream in listener.incoming() {
        if stop.load(Ordering::Relaxed) {
            return;
        }
        let Ok(stream) = stream else {
            // Out of descriptors, for example: others will be given back.
            std::thread::sleep(Duration::from_millis(50));
            continue;
        };
        let place = Place::taken(&open);
        if open.load(Ordering::SeqCst) > MOST_CONNECTIONS {
            let _ = stream.set_write_timeout(Some(Duration::from_millis(100)));
            let _ = (&stream).write_all(&Response::refusal(503, "too many connections").bytes());
            continue;
        }
        let answer = Arc::clone(&answer);
        // Without a thread the connection is closed.
        let _ = std::thread::Builder::new().spawn(move || {
            let _place = place;
            converse(&stream, &*answer);
        });
    }
}

/// One of the connections that may be open.
struct Place(Arc<AtomicUsize>);

impl Place {
    fn taken(open: &Arc<AtomicUsize>) -> Self {
        open.fetch_add(1, Ordering::SeqCst);
        Place(Arc::clone(open))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

fn converse(stream: &TcpStream, answer: &impl Fn(&Request) -> Response) {
    let response = match read(stream) {
        Ok(request) => answer(&request),
        Err(Some(refusal)) => refusal,
        Err(None) => return,
    };
    let _ = stream.set_write_timeout(Some(PATIENCE));
    let mut out = stream;
    if out.write_all(&response.bytes()).is_ok() {
        // What is still on its way is taken, a little while: closed at once, the answer could be lost with it.
        let _ = stream.shutdown(Shutdown::Write);
        let _ = stream.set_read_timeout(Some(Duration::from_millis(200)));
        let (mut rest, mut sink, start) = (4 * MOST_BODY, [0; 4096], Instant::now());
        while let Ok(n @ 1..) = out.read(&mut sink) {
            rest = rest.saturating_sub(n);
            if rest == 0 || start.elapsed() > Duration::from_secs(1) {
                break;
            }
        }
    }
}

/// A request, or why there is none: `None` if the other side is gone.
fn read(stream: &TcpStream) -> Result<Request, Option<Response>> {
    let deadline = Instant::now() + PATIENCE;
    let mut bytes = Vec::new();
    let end = loop {
        let end = bytes.windows(4).position(|w| w == b"\r\n\r\n");
        if end.unwrap_or(bytes.len()) > MOST_HEAD {
            return Err(Some(Response::refusal(431, "the headers are too long")));
        }
        if let Some(end) = end {
            break end;
        }
        more(stream, deadline, &mut bytes)?;
    };
    let body = bytes.split_off(end + 4);
    let mut request = head(&bytes[..end]).map_err(Some)?;
    let length = length(&request).map_err(Some)?;
    request.body = body;
    while request.body.len() < length {
        more(stream, deadline, &mut request.body)?;
    }
    request.body.truncate(length);
    Ok(request)
}

/// Some more bytes before the deadline.
fn more(mut stream: &TcpStream, deadline: Instant, bytes: &mut Vec<u8>) -> Result<(), Option<Response>> {
    let late = || Some(Response::refusal(408, "the request takes too long"));
    let left = deadline.checked_duration_since(Instant::now()).filter(|d| !d.is_zero()).ok_or_else(late)?;
    stream.set_read_timeout(Some(left)).map_err(|_| None)?;
    let mut some = [0; 8192];
    match stream.read(&mut some) {
        Ok(0) => Err(None),
        Ok(n) => {
            bytes.extend_from_slice(&some[..n]);
            Ok(())
        }
        Err(e) if e.kind() == ErrorKind::Interrupted => Ok(()),
        Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => Err(late()),
        Err(_) => Err(None),
    }
}

/// First line and headers.
fn head(bytes: &[u8]) -> Result<Request, Response> {
    let bad = |reason: &str| Response::refusal(400, reason);
    let text = std::str::from_utf8(bytes).map_err(|_| bad("headers that are not text"))?;
    let mut lines = text.split("\r\n");
    let words: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, target, version] = words[..] else { return Err(bad("no request line")) };
    if !matches!(version, "HTTP/1.1" | "HTTP/1.0") {
        return Err(Response::refusal(505, "this is HTTP/1.1"));
    }
    if method.is_empty() || !method.bytes().all(|b| b.is_ascii_uppercase()) || !target.starts_with('/') {
        return Err(bad("no request line"));
    }
    let mut headers: Vec<(String, String)> = Vec::new();
    for line in lines {
        let (name, value) = line.split_once(':').ok_or_else(|| bad("a header without a colon"))?;
        let token = |b: u8| b.is_ascii_alphanumeric() || b"!#$%&'*+-.^_`|~".contains(&b);
        if name.is_empty() || !name.bytes().all(token) || value.contains(|c: char| c.is_control() && c != '\t') {
            return Err(bad("a header that is none"));
        }
        let name = name.to_ascii_lowercase();
        if matches!(name.as_str(), "host" | "content-length" | "origin") && headers.iter().any(|(n, _)| *n == name) {
            return Err(bad("a header twice"));
        }
        headers.push((name, value.trim().into()));
    }
    Ok(Request { method: method.into(), target: target.into(), headers, body: Vec::new() })
}

/// Length of the body.
fn length(request: &Request) -> Result<usize, Response> {
    if request.header("transfer-encoding").is_some() {
        return Err(Response::refusal(501, "send the length of the body"));
    }
    let Some(given) = request.header("content-length") else {
        let needed = request.method == "POST";
        return if needed { Err(Response::refusal(411, "send the length of the body")) } else { Ok(0) };
    };
    if given.is_empty() || !given.bytes().all(|b| b.is_ascii_digit()) {
        return Err(Response::refusal(400, "a length that is no number"));
    }
    match given.parse() {
        Ok(length) if length <= MOST_BODY => Ok(length),
        _ => Err(Response::refusal(413, &format!("at most {MOST_BODY} bytes"))),
    }
}
