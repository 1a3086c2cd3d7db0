//! Registry of attachments: each attachment's function, cached answers and call counts.

use std::collections::BTreeMap;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use rustc_hash::FxHashMap;
use serde::{Deserialize, Serialize};

use super::{Answer, Attachment, AttachmentError, Call, CallError, CallKind, FactValue, Level, Read};

/// Counts of the questions to one attachment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct CallStatistics {
    /// Exact calls that the attachment itself answered (not the cache).
    pub calls: u64,
    /// Relaxed calls that the attachment itself answered (not the cache).
    pub relaxed: u64,
    /// Number of questions that a cache answered.
    pub hits: u64,
    /// Time spent in the attachment by the clock of [`Attachments::with_clock`], seconds; 0 without
    /// a clock.
    pub time_s: f64,
}

/// Attachments by name, each with its cache of answers and its call counts.
#[derive(Default)]
pub struct Attachments {
    registered: BTreeMap<String, Registered>,
    clock_s: Option<Box<dyn Fn() -> f64 + Send + Sync>>,
}

struct Registered {
    attachment: Arc<dyn Attachment>,
    reads: Vec<Read>,
    cache: Mutex<FxHashMap<CacheKey, Answer>>,
    exact: AtomicU64,
    relaxed: AtomicU64,
    hits: AtomicU64,
    time_ns: AtomicU64,
}

#[derive(PartialEq, Eq, Hash)]
struct CacheKey {
    level: Level,
    module: Arc<str>,
    arguments: Vec<Arc<str>>,
    /// Truth values of the readings, two bits each: 0 false, 1 true, 2 "not a truth value: see
    /// `others`". Packed because a call may have hundreds of readings.
    truths: Vec<u64>,
    /// Values of the readings that are no truth values, in the order of the call.
    others: Vec<KeyValue>,
}

#[derive(PartialEq, Eq, Hash)]
enum KeyValue {
    Number(u64),
    Object(Arc<str>),
    Undefined,
}

impl CacheKey {
    fn new(call: &Call, level: Level) -> CacheKey {
        const A_WORD: usize = 32;
        let mut truths = vec![0; call.readings.len().div_ceil(A_WORD)];
        let mut others = Vec::new();
        for (n, reading) in call.readings.iter().enumerate() {
            let bits = match &reading.value {
                FactValue::Truth(truth) => u64::from(*truth),
                other => {
                    others.push(match other {
                        // Adding zero makes -0.0 and 0.0 one key.
                        FactValue::Number(number) => KeyValue::Number((number + 0.0).to_bits()),
                        FactValue::Object(name) => KeyValue::Object(name.clone()),
                        _ => KeyValue::Undefined,
                    });
                    2
                }
            };
            truths[n / A_WORD] |= bits << (2 * (n % A_WORD));
        }
        CacheKey { level, module: call.module.clone(), arguments: call.arguments.clone(), truths, others }
    }
}

impl fmt::Debug for Attachments {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_set().entries(self.registered.keys()).finish()
    }
}

impl Attachments {
    /// Creates an empty registry.
    pub fn new() -> Attachments {
        Attachments::default()
    }

    /// Makes the registry time each call with `clock_s`: seconds from an arbitrary origin,
    /// monotonic.
    pub fn with_clock(self, clock_s: impl Fn() -> f64 + Send + Sync + 'static) -> Attachments {
        Attachments { clock_s: Some(Box::new(clock_s)), ..self }
    }

    /// Registers `attachment` under `name`, replacing one registered earlier under that name.
    ///
    /// The name is what stands before the `@` in the domain (`fn` of `fn@lib.so`), or the module's PDDL name.
    pub fn insert(&mut self, name: impl Into<String>, attachment: impl Attachment + 'static) {
        self.insert_shared(name, Arc::new(attachment));
    }

    /// Like [`Attachments::insert`], for an attachment that the caller shares.
    pub fn insert_shared(&mut self, name: impl Into<String>, attachment: Arc<dyn Attachment>) {
        let registered = Registered {
            reads: attachment.reads(),
            attachment,
            cache: Mutex::default(),
            exact: AtomicU64::new(0),
            relaxed: AtomicU64::new(0),
            hits: AtomicU64::new(0),
            time_ns: AtomicU64::new(0),
        };
        self.registered.insert(name.into(), registered);
    }

    /// Name of the registered attachment that a module's binding (`fn@lib.so` or `fn`) or PDDL name
    /// selects; `None` if there is none.
    ///
    /// The exact spelling of the binding is preferred, then its part before the `@`, then the PDDL name, then either
    /// without regard to case.
    pub fn resolve(&self, binding: &str, module: &str) -> Option<&str> {
        let function = binding.split('@').next().unwrap_or(binding);
        let exact =
            [binding, function, module].into_iter().find_map(|name| self.registered.get_key_value(name));
        let found = exact.or_else(|| {
            self.registered
                .iter()
                .find(|(name, _)| name.eq_ignore_ascii_case(function) || name.eq_ignore_ascii_case(module))
        });
        found.map(|(name, _)| name.as_str())
    }

    /// Names of all registered attachments, in alphabetical order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.registered.keys().map(String::as_str)
    }

    /// Declared read set of the attachment `name` (empty for an unknown name).
    pub fn reads(&self, name: &str) -> &[Read] {
        self.registered.get(name).map_or(&[], |registered| &registered.reads)
    }

    /// Counter of cached answers of the attachment `name`, for a caller with a cache of its own.
    pub(crate) fn hits(&self, name: &str) -> Option<&AtomicU64> {
        self.registered.get(name).map(|registered| &registered.hits)
    }

    /// Passes one entry of `:moduleoptions` to the attachment `name`; `Ok(false)` if no attachment
    /// has that name.
    pub fn configure(&self, name: &str, options: &[String]) -> Result<bool, AttachmentError> {
        let Some(found) = self.resolve(name, name) else { return Ok(false) };
        let Some(registered) = self.registered.get(found) else { return Ok(false) };
        registered.attachment.configure(options).map(|()| true).map_err(|cause| AttachmentError {
            call: format!("({name} {})", options.join(" ")),
            module: name.to_string(),
            attachment: found.to_string(),
            cause,
        })
    }

    /// Answers a call from the cache, or else by asking the attachment `name`.
    ///
    /// Errors are not cached. An answer that does not fit the module's kind is a [`CallError::WrongAnswer`].
    pub fn call(&self, name: &str, call: &Call, level: Level) -> Result<Answer, AttachmentError> {
        let registered = self.registered(name, call)?;
        let mut key = CacheKey::new(call, level);
        if let Some(answer) = registered.lookup(&key) {
            return Ok(answer);
        }
        let mut before = self.now_s();
        let relaxed = match level {
            Level::Relaxed => registered.attachment.relaxed(call),
            Level::Exact => None,
        };
        let answer = match relaxed {
            Some(answer) => {
                registered.relaxed.fetch_add(1, Ordering::Relaxed);
                answer
            }
            None => {
                if level == Level::Relaxed {
                    key.level = Level::Exact;
                    if let Some(answer) = registered.lookup(&key) {
                        return Ok(answer);
                    }
                    before = self.now_s();
                }
                registered.exact.fetch_add(1, Ordering::Relaxed);
                registered.attachment.evaluate(call)
            }
        };
        registered.add_time(self.now_s() - before);
        let answer = checked(answer, call).map_err(|cause| failure(name, call, cause))?;
        registered.store(key, &answer);
        Ok(answer)
    }

    /// Exact answers of many calls; the calls that the cache does not hold are sent in one batch.
    pub fn call_all(&self, name: &str, calls: &[Call]) -> Vec<Result<Answer, AttachmentError>> {
        let Some(registered) = self.registered.get(name) else {
            return calls.iter().map(|call| Err(missing(name, call))).collect();
        };
        let keys: Vec<CacheKey> = calls.iter().map(|call| CacheKey::new(call, Level::Exact)).collect();
        let mut answers: Vec<Option<Result<Answer, AttachmentError>>> =
            keys.iter().map(|key| registered.lookup(key).map(Ok)).collect();
        let open: Vec<usize> = (0..calls.len()).filter(|&index| answers[index].is_none()).collect();
        if !open.is_empty() {
            let batch: Vec<Call> = open.iter().map(|&index| calls[index].clone()).collect();
            let before = self.now_s();
            registered.exact.fetch_add(batch.len() as u64, Ordering::Relaxed);
            let mut given = registered.attachment.evaluate_all(&batch).into_iter();
            registered.add_time(self.now_s() - before);
            for (&index, call) in open.iter().zip(&batch) {
                let answer = given.next().unwrap_or_else(|| {
                    Err(CallError::WrongAnswer {
                        expected: format!("{} answers", batch.len()),
                        got: "fewer".to_string(),
                    })
                });
                answers[index] = Some(checked(answer, call).map_err(|cause| failure(name, call, cause)));
            }
        }
        for (key, answer) in keys.into_iter().zip(&answers) {
            if let Some(Ok(answer)) = answer {
                registered.store(key, answer);
            }
        }
        answers
            .into_iter()
            .zip(calls)
            .map(|(answer, call)| answer.unwrap_or_else(|| Err(missing(name, call))))
            .collect()
    }

    /// Call counts of each attachment since its registration, by name.
    pub fn statistics(&self) -> BTreeMap<String, CallStatistics> {
        let counts = self.registered.iter().map(|(name, registered)| (name.clone(), registered.statistics()));
        counts.collect()
    }

    /// Clears all cached answers and keeps the counts; needed after the data behind the attachments
    /// has changed.
    pub fn forget(&self) {
        for registered in self.registered.values() {
            registered.cache.lock().unwrap_or_else(PoisonError::into_inner).clear();
        }
    }

    fn registered(&self, name: &str, call: &Call) -> Result<&Registered, AttachmentError> {
        self.registered.get(name).ok_or_else(|| missing(name, call))
    }

    fn now_s(&self) -> f64 {
        self.clock_s.as_ref().map_or(0.0, |clock_s| clock_s())
    }
}

impl Registered {
    fn lookup(&self, key: &CacheKey) -> Option<Answer> {
        let cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let found = cache.get(key).cloned();
        if found.is_some() {
            self.hits.fetch_add(1, Ordering::Relaxed);
        }
        found
    }

    fn store(&self, key: CacheKey, answer: &Answer) {
        self.cache.lock().unwrap_or_else(PoisonError::into_inner).insert(key, answer.clone());
    }

    fn add_time(&self, elapsed_s: f64) {
        self.time_ns.fetch_add((elapsed_s.max(0.0) * 1e9) as u64, Ordering::Relaxed);
    }

    fn statistics(&self) -> CallStatistics {
        CallStatistics {
            calls: self.exact.load(Ordering::Relaxed),
            relaxed: self.relaxed.load(Ordering::Relaxed),
            hits: self.hits.load(Ordering::Relaxed),
            time_s: self.time_ns.load(Ordering::Relaxed) as f64 * 1e-9,
        }
    }
}

fn checked(answer: Result<Answer, CallError>, call: &Call) -> Result<Answer, CallError> {
    let answer = answer?.of_kind(call.kind);
    if answer.fits(call.kind) {
        return Ok(answer);
    }
    let expected = match call.kind {
        CallKind::Cost => "a number from 0 to infinity",
        CallKind::Condition => "true or false",
        CallKind::Effect => "a list of finite numbers, truths or object names",
        CallKind::Grounding => "a list of names",
    };
    Err(CallError::WrongAnswer { expected: expected.to_string(), got: format!("{answer:?}") })
}

fn failure(name: &str, call: &Call, cause: CallError) -> AttachmentError {
    AttachmentError {
        call: call.to_string(),
        module: call.module.to_string(),
        attachment: name.to_string(),
        cause,
    }
}

fn missing(name: &str, call: &Call) -> AttachmentError {
    failure(name, call, CallError::Failed("no attachment of this name is registered".to_string()))
}
