//! Model Context Protocol over standard input and output: JSON-RPC 2.0, one message a line.
//!
//! Each tool runs a descry command in a process of its own, so that a call cannot harm the server, and a
//! cancelled call stops like a command on Ctrl-C.

mod call;
mod tools;

use std::collections::BTreeMap;
use std::io::{self, BufRead, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use serde_json::{Value, json};

use crate::child::Child;

/// Supported versions of the protocol, newest first.
const VERSIONS: [&str; 4] = ["2025-11-25", "2025-06-18", "2025-03-26", "2024-11-05"];
/// Maximum size of a message, bytes.
const MESSAGE_BYTES: usize = 16 << 20;

/// JSON-RPC error code: the text is not JSON.
const PARSE_ERROR: i64 = -32700;
/// JSON-RPC error code: the message is not a request.
const INVALID_REQUEST: i64 = -32600;
/// JSON-RPC error code: unknown method.
const METHOD_NOT_FOUND: i64 = -32601;
/// JSON-RPC error code: invalid parameters of a method or tool.
const INVALID_PARAMS: i64 = -32602;

const INSTRUCTIONS: &str = "descry plans in PDDL and has a robot look for things. Check a domain and mend it by its findings before \
you plan; each finding has a place and most have a mend. `goals` lists what may be said to `run`. A run answers achieved, not_found \
(all was seen), cannot_tell (something was not, and it says what), impossible or failed; `explain` tells why.";

/// Permissions of a server.
pub(crate) struct Served {
    /// Folder for runs; callers may only name files below it.
    pub(crate) folder: PathBuf,
    /// Body that callers may use besides the simulated one.
    pub(crate) robot: Option<String>,
}

/// Serves until the input ends.
///
/// # Errors
/// If the input cannot be read.
pub(crate) fn serve(served: Served) -> io::Result<()> {
    let mut server = Server { served: Arc::new(served), calls: BTreeMap::new(), threads: Vec::new() };
    let mut input = io::stdin().lock();
    loop {
        let mut line = Vec::new();
        let read = io::Read::take(&mut input, MESSAGE_BYTES as u64).read_until(b'\n', &mut line)?;
        if read == 0 || (read == MESSAGE_BYTES && line.last() != Some(&b'\n')) {
            break;
        }
        if line.iter().all(u8::is_ascii_whitespace) {
            continue;
        }
        match serde_json::from_slice::<Value>(&line) {
            Ok(message) => server.hear(&message),
            Err(e) => refuse(&Value::Null, PARSE_ERROR, &format!("the message is no JSON: {e}")),
        }
    }
    server.calls.values().for_each(|call| call.stop());
    for thread in server.threads {
        let _ = thread.join();
    }
    Ok(())
}

struct Server {
    served: Arc<Served>,
    /// Running calls by the text of their request ID.
    calls: BTreeMap<String, Arc<Child>>,
    threads: Vec<JoinHandle<()>>,
}

impl Server {
    fn hear(&mut self, message: &Value) {
        let parameters = &message["params"];
        let Some(method) = message["method"].as_str() else {
            // Nothing is asked of clients, so there is no answer to wait for.
            if message.get("result").is_none() && message.get("error").is_none() {
                refuse(&message["id"], INVALID_REQUEST, "a message needs a `method`");
            }
            return;
        };
        let Some(id) = message.get("id").filter(|id| !id.is_null()) else {
            if method == "notifications/cancelled"
                && let Some(call) = self.calls.get(&parameters["requestId"].to_string())
            {
                call.stop();
            }
            return;
        };
        match method {
            "initialize" => answer(id, greeting(parameters)),
            "ping" => answer(id, json!({})),
            "tools/list" => answer(id, json!({ "tools": tools::listed(self.served.robot.is_some()) })),
            "tools/call" => self.call(id, parameters),
            _ => refuse(id, METHOD_NOT_FOUND, &format!("there is no method `{method}` here")),
        }
    }

    fn call(&mut self, id: &Value, parameters: &Value) {
        let name = parameters["name"].as_str().unwrap_or_default();
        let Some(tool) = tools::named(name) else {
            let known: Vec<&str> = tools::TOOLS.iter().map(|tool| tool.name).collect();
            let text = format!("there is no tool `{name}`; there are {}", known.join(", "));
            return refuse(id, INVALID_PARAMS, &text);
        };
        let task = match tool.task(&parameters["arguments"], &self.served) {
            Ok(task) => task,
            Err(because) => return refuse(id, INVALID_PARAMS, &because),
        };
        let progress = parameters["_meta"].get("progressToken").cloned();
        self.calls.retain(|_, call| !call.has_ended());
        self.threads.retain(|thread| !thread.is_finished());
        let call = Arc::new(Child::default());
        self.calls.insert(id.to_string(), Arc::clone(&call));
        let (id, served) = (id.clone(), Arc::clone(&self.served));
        self.threads.push(std::thread::spawn(move || {
            let mut steps = 0_u64;
            let mut tell = |line: &str| {
                let Some(token) = &progress else { return };
                steps += 1;
                let said = json!({ "progressToken": token, "progress": steps, "message": line });
                say(&json!({ "jsonrpc": "2.0", "method": "notifications/progress", "params": said }));
            };
            let result = call::carry_out(&call, &task, &served, &mut tell);
            // Who cancelled a call waits for no answer.
            if let Some(result) = result {
                answer(&id, result);
            }
        }));
    }
}

fn greeting(parameters: &Value) -> Value {
    let wanted = parameters["protocolVersion"].as_str().unwrap_or_default();
    let version = VERSIONS.iter().find(|known| **known == wanted).unwrap_or(&VERSIONS[0]);
    json!({
        "protocolVersion": version,
        "capabilities": { "tools": {} },
        "serverInfo": { "name": "descry", "version": env!("CARGO_PKG_VERSION") },
        "instructions": INSTRUCTIONS,
    })
}

fn answer(id: &Value, result: Value) {
    say(&json!({ "jsonrpc": "2.0", "id": id, "result": result }));
}

fn refuse(id: &Value, code: i64, message: &str) {
    say(&json!({ "jsonrpc": "2.0", "id": id, "error": { "code": code, "message": message } }));
}

/// Output lock, which keeps the lines of several threads apart.
static OUT: Mutex<()> = Mutex::new(());

fn say(message: &Value) {
    let _one = OUT.lock().unwrap_or_else(PoisonError::into_inner);
    let mut out = io::stdout().lock();
    // A client that has gone closes the input, too.
    let _ = writeln!(out, "{message}").and_then(|()| out.flush());
}
