//! A headless Chromium for tests of pages, driven through the pipe of its DevTools protocol.
//!
//! A failure in it is one of the test, so its functions panic.
#![forbid(unsafe_code)]

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Longest wait for an answer: drawing sixty figures on a busy machine takes seconds, not this.
const PATIENCE: Duration = Duration::from_secs(120);
/// Programs that speak the protocol.
const PROGRAMS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// Variable by which `cargo xtask test` makes a missing browser a failure.
const REQUIRED: &str = "QUADRANT_BROWSER_TESTS";

/// A browser with one tab.
#[derive(Debug)]
pub struct Browser {
    process: Child,
    requests: ChildStdin,
    answers: Receiver<Value>,
    next_id: u64,
    session: Option<String>,
    problems: Vec<String>,
    loads: usize,
    downloads: usize,
    folder: tempfile::TempDir,
}

impl Browser {
    /// Starts the browser; `None`, with a message, where there is none and none is required.
    pub fn start() -> Option<Self> {
        let Some(program) = find() else {
            let message = "no Chromium in the search path: install the package chromium, or run cargo xtask setup";
            assert_ne!(
                std::env::var(REQUIRED).as_deref(),
                Ok("required"),
                "{message}"
            );
            eprintln!("skipped: {message}");
            return None;
        };
        let folder = tempfile::tempdir().unwrap();
        // The protocol's pipe is on descriptors 3 and 4, which only a shell can give without unsafe code.
        let mut process = Command::new("sh")
            .args([
                "-c",
                "exec \"$0\" \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1",
            ])
            .arg(program)
            // Root, which continuous integration is, has no sandbox; the pages are our own.
            .args([
                "--headless",
                "--no-sandbox",
                "--disable-gpu",
                "--no-first-run",
            ])
            .args(["--disable-dev-shm-usage", "--remote-debugging-pipe"])
            .arg(format!(
                "--user-data-dir={}",
                folder.path().join("profile").display()
            ))
            .arg("about:blank")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let requests = process.stdin.take().unwrap();
        let mut pipe = BufReader::new(process.stdout.take().unwrap());
        let (sender, answers) = channel();
        std::thread::spawn(move || {
            let mut message = Vec::new();
            while pipe
                .read_until(0, &mut message)
                .is_ok_and(|length| length > 0)
            {
                message.pop();
                let Ok(value) = serde_json::from_slice(&message) else {
                    break;
                };
                if sender.send(value).is_err() {
                    break;
                }
                message.clear();
            }
        });
        let mut browser = Self {
            process,
            requests,
            answers,
            next_id: 0,
            session: None,
            problems: Vec::new(),
            loads: 0,
            downloads: 0,
            folder,
        };
        browser.attach();
        Some(browser)
    }

    fn attach(&mut self) {
        let target = self.call("Target.createTarget", json!({"url": "about:blank"}));
        let target = json!({"targetId": target["targetId"], "flatten": true});
        let session = self.call("Target.attachToTarget", target);
        let downloads = self.download_folder();
        std::fs::create_dir(&downloads).unwrap();
        let allow = json!({"behavior": "allow", "downloadPath": downloads, "eventsEnabled": true});
        self.call("Browser.setDownloadBehavior", allow);
        self.session = session["sessionId"].as_str().map(str::to_owned);
        for domain in ["Page", "Runtime", "Log", "Network"] {
            self.call(&format!("{domain}.enable"), json!({}));
        }
    }

    /// Folder that downloads go to.
    fn download_folder(&self) -> PathBuf {
        self.folder.path().join("downloads")
    }

    /// Sends a request and waits for its answer; keeps what the page complains of meanwhile.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.next_id += 1;
        let mut request = json!({"id": self.next_id, "method": method, "params": parameters});
        if let Some(session) = &self.session {
            request["sessionId"] = json!(session);
        }
        self.requests
            .write_all(request.to_string().as_bytes())
            .unwrap();
        self.requests.write_all(&[0]).unwrap();
        let id = self.next_id;
        loop {
            let message = self.receive(method);
            if message["id"] == id {
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].clone();
            }
        }
    }

    fn receive(&mut self, waiting_for: &str) -> Value {
        let message = self.answers.recv_timeout(PATIENCE);
        let message = message.unwrap_or_else(|error| panic!("{waiting_for}: {error}"));
        let event = &message["params"];
        match message["method"].as_str().unwrap_or_default() {
            "Page.loadEventFired" => self.loads += 1,
            "Browser.downloadProgress" if event["state"] == "completed" => self.downloads += 1,
            "Runtime.exceptionThrown" => {
                let details = &event["exceptionDetails"];
                self.problems.push(format!("exception: {details}"));
            }
            "Runtime.consoleAPICalled" if event["type"] == "error" => {
                self.problems.push(format!("console: {}", event["args"]));
            }
            "Log.entryAdded" if event["entry"]["level"] == "error" => {
                self.problems
                    .push(format!("log: {}", event["entry"]["text"]));
            }
            "Network.requestWillBeSent" => {
                let url = event["request"]["url"].as_str().unwrap_or_default();
                if !["file:", "data:", "blob:", "about:"]
                    .iter()
                    .any(|scheme| url.starts_with(scheme))
                {
                    self.problems.push(format!("request: {url}"));
                }
            }
            _ => {}
        }
        message
    }

    /// Returns the page's complaints since the last call: errors, exceptions, violations, requests.
    pub fn problems(&mut self) -> Vec<String> {
        std::mem::take(&mut self.problems)
    }

    /// Opens a page in a window of a size, in CSS pixels, on a device that prefers light or dark pages.
    pub fn open(&mut self, page: &Path, (width, height): (u32, u32), is_dark: bool) {
        let metrics = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600});
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        self.emulate("screen", is_dark);
        let loads = self.loads;
        let url = format!("file://{}", page.display());
        self.call("Page.navigate", json!({"url": url}));
        while self.loads == loads {
            self.receive("the page's load event");
        }
    }

    /// Shows the page as on a medium, "screen" or "print", that prefers light or dark pages.
    pub fn emulate(&mut self, medium: &str, is_dark: bool) {
        let scheme = if is_dark { "dark" } else { "light" };
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.call(
            "Emulation.setEmulatedMedia",
            json!({"media": medium, "features": features}),
        );
    }

    /// The value of an expression, awaited if it is a promise.
    pub fn evaluate(&mut self, expression: &str) -> Value {
        let answer = self.call(
            "Runtime.evaluate",
            json!({"expression": expression, "awaitPromise": true, "returnByValue": true, "userGesture": true}),
        );
        let exception = &answer["exceptionDetails"];
        assert!(exception.is_null(), "{expression}: {exception}");
        answer["result"]["value"].clone()
    }

    /// Clicks on what a selector finds, and returns the file that is downloaded, by the name it was given.
    pub fn download(&mut self, selector: &str, name: &str) -> Option<Vec<u8>> {
        let before = self.downloads;
        self.evaluate(&format!("document.querySelector({selector:?}).click()"));
        let started = Instant::now();
        while self.downloads == before && started.elapsed() < PATIENCE {
            self.receive("a download");
        }
        std::fs::read(self.download_folder().join(name)).ok()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // A test that failed must not leave a browser behind.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn find() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    PROGRAMS
        .iter()
        .flat_map(|program| folders.iter().map(move |folder| folder.join(program)))
        .find(|file| file.is_file())
}
