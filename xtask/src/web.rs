//! The page of the bench: one HTML file with everything in it, which a browser opens from a disk as from a server.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use base64::prelude::{BASE64_STANDARD, Engine};
use flate2::Compression;
use flate2::write::GzEncoder;

use xtask::command;
use xtask::toolchain::{Toolchain, WEB_TRIPLE};

/// The page.
const PAGE: &str = "target/web/quadrant-bench.html";
/// Packages that npm fetches for it.
const FETCHED: &str = "target/web/npm";
/// Its sources.
const SOURCES: &str = "bench/page";
/// Its scripts, in the order in which they name each other.
const SCRIPTS: [&str; 10] = [
    "machine.js",
    "tour.js",
    "plots.js",
    "guide.js",
    "bench.js",
    "link.js",
    "strips.js",
    "draft.js",
    "board.js",
    "start.js",
];
/// Largest page, bytes.
const MOST_BYTES: usize = 1_500_000;
/// Path of the page, for the test that opens it.
const PAGE_VARIABLE: &str = "QUADRANT_BENCH_PAGE";

/// Builds the page and returns its path.
pub(crate) fn build(toolchain: Toolchain) -> Result<PathBuf> {
    let root = command::root();
    let sources = root.join(SOURCES);
    let source = |name: &str| read(&sources.join(name));
    let plots = fetch()?;
    let mut cargo = toolchain.web_cargo("build")?;
    cargo.args(["--package", "quadrant-bench", "--lib", "--profile", "web"]);
    command::run(&mut cargo)?;
    let wasm = root.join(format!("target/web/{WEB_TRIPLE}/web/quadrant_bench.wasm"));
    let wasm = fs::read(&wasm).with_context(|| format!("cannot read {}", wasm.display()))?;

    let scripts = SCRIPTS.iter().map(|name| source(name));
    let scripts = scripts.collect::<Result<Vec<_>>>()?.join("\n");
    let dist = |name: &str| read(&plots.join("dist").join(name));
    let style = format!("{}\n{}", dist("uPlot.min.css")?, source("page.css")?);
    let licence = read(&plots.join("LICENSE"))?;
    let script = format!("/* uPlot\n{licence}*/\n{}", dist("uPlot.iife.min.js")?);
    let page = source("index.html")?
        .replace("{{version}}", env!("CARGO_PKG_VERSION"))
        .replace("{{style}}", &style)
        .replace("{{uplot}}", &script)
        .replace("{{script}}", &scripts)
        .replace("{{wasm}}", &packed(&wasm)?);
    ensure!(
        page.len() <= MOST_BYTES,
        "the page has {} bytes; {MOST_BYTES} are allowed",
        page.len()
    );
    let path = root.join(PAGE);
    fs::write(&path, &page).with_context(|| format!("cannot write {}", path.display()))?;
    println!(
        "{}: {} kB, of which WebAssembly {} kB",
        path.display(),
        page.len() / 1000,
        wasm.len() / 1000
    );
    Ok(path)
}

/// Compares the page's converter words with the host's, and tries its view of a machine, in a browser.
pub(crate) fn check(page: &Path) -> Result<()> {
    // Of the whole workspace, like the other tests: else the libraries would be built once more.
    let mut test = command::command("cargo");
    test.args(["test", "--workspace", "--test", "browser", "--"])
        .args(["--ignored", "--nocapture"])
        .env(PAGE_VARIABLE, page)
        .env("QUADRANT_BROWSER_TESTS", "required");
    command::ensure_tests(&test)?;
    command::run(&mut test)
}

/// Serves the page to this machine's browsers until the process is ended.
pub(crate) fn serve(page: &Path, port: u16) -> Result<()> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
        .with_context(|| format!("cannot listen on port {port}; --port takes another"))?;
    println!("http://{}", listener.local_addr()?);
    let page = fs::read(page)?;
    for connection in listener.incoming().flatten() {
        // A browser that hangs up early asks again.
        let _ = reply(connection, &page);
    }
    Ok(())
}

fn reply(mut connection: TcpStream, page: &[u8]) -> std::io::Result<()> {
    let mut request = String::new();
    let mut lines = BufReader::new(connection.try_clone()?);
    lines.read_line(&mut request)?;
    // What follows the first line is read, or closing would reset the connection.
    let mut line = String::new();
    while lines.read_line(&mut line)? > 2 {
        line.clear();
    }
    let (status, body) = if asks_for_page(&request) {
        ("200 OK", page)
    } else {
        ("404 Not Found", &[][..])
    };
    write!(
        connection,
        "HTTP/1.1 {status}\r\nContent-Type: text/html; charset=utf-8\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        body.len()
    )?;
    connection.write_all(body)
}

/// True if the first line of a request asks for the page, in any of its views.
fn asks_for_page(request: &str) -> bool {
    ["GET / ", "GET /?"]
        .iter()
        .any(|start| request.starts_with(start))
}

/// Lets npm fetch the plotting library, unless it is there, and returns its folder.
fn fetch() -> Result<PathBuf> {
    let root = command::root();
    let (sources, folder) = (root.join(SOURCES), root.join(FETCHED));
    let lock = "package-lock.json";
    let found = folder.join("node_modules/uplot");
    let is_same = fs::read(folder.join(lock)).ok() == fs::read(sources.join(lock)).ok();
    if is_same && found.join("package.json").is_file() {
        return Ok(found);
    }
    ensure!(
        command::exists("npm"),
        "npm is needed to fetch the plotting library of the page"
    );
    fs::create_dir_all(&folder)?;
    for name in ["package.json", lock] {
        fs::copy(sources.join(name), folder.join(name))
            .with_context(|| format!("cannot copy {name}"))?;
    }
    command::run(command::command("npm").current_dir(&folder).args([
        "ci",
        "--ignore-scripts",
        "--no-audit",
        "--no-fund",
    ]))?;
    Ok(found)
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

/// Bytes in gzip's format, as text: a third of their length as they are.
fn packed(bytes: &[u8]) -> Result<String> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(bytes)?;
    Ok(BASE64_STANDARD.encode(gzip.finish()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_views_are_served_and_nothing_else() {
        assert!(asks_for_page("GET / HTTP/1.1"));
        assert!(asks_for_page("GET /?machine=serial HTTP/1.1"));
        assert!(!asks_for_page("GET /favicon.ico HTTP/1.1"));
    }
}
