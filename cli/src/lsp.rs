//! Language server: findings as the user types with their fixes, hover, definitions, completion, formatting
//! and symbols, for PDDL, plans and the TOML files of a domain. The findings equal those of `descry check`,
//! the formatting that of `descry fmt`.

mod declared;
mod findings;
#[doc(hidden)]
pub mod keys;
mod mends;
#[doc(hidden)]
pub mod texts;
mod units;
mod words;

use lsp_server::{Connection, ErrorCode, ExtractError, Message, Notification, Request, Response};
use lsp_types::notification::{
    DidChangeTextDocument, DidCloseTextDocument, DidOpenTextDocument, DidSaveTextDocument, Notification as _,
    PublishDiagnostics,
};
use lsp_types::request::{
    CodeActionRequest, Completion, DocumentSymbolRequest, Formatting, GotoDefinition, HoverRequest,
    Request as _,
};
use lsp_types::{
    CodeActionKind, CodeActionOptions, CodeActionProviderCapability, CompletionOptions,
    HoverProviderCapability, OneOf, PublishDiagnosticsParams, SaveOptions, ServerCapabilities,
    TextDocumentSyncCapability, TextDocumentSyncKind, TextDocumentSyncOptions, TextDocumentSyncSaveOptions,
};
use serde::de::DeserializeOwned;
use serde_json::{Value, json};

use descry_agent::exit::CommandError;
use texts::Texts;

/// Serves an editor over standard input and output until it disconnects.
///
/// # Errors
/// [`CommandError::Broken`] if the editor violates the protocol, or disconnects without a shutdown.
pub fn serve() -> Result<(), CommandError> {
    let (connection, threads) = Connection::stdio();
    serve_over(&connection)?;
    drop(connection);
    threads.join().map_err(CommandError::broken)
}

/// Serves an editor over a connection until it disconnects.
///
/// # Errors
/// [`CommandError::Broken`] if the editor violates the protocol, or disconnects without a shutdown.
pub fn serve_over(connection: &Connection) -> Result<(), CommandError> {
    let capabilities = serde_json::to_value(capabilities()).map_err(|e| CommandError::Bug(e.to_string()))?;
    let (id, _) = connection.initialize_start().map_err(|e| {
        let means = "expected an editor on standard input: one that starts `descry lsp` by itself";
        CommandError::broken(format!("{e}\n  {means}"))
    })?;
    let server = json!({ "name": "descry", "version": env!("CARGO_PKG_VERSION") });
    let said = json!({ "capabilities": capabilities, "serverInfo": server });
    connection.initialize_finish(id, said).map_err(CommandError::broken)?;
    converse(connection)
}

fn capabilities() -> ServerCapabilities {
    let sync = TextDocumentSyncOptions {
        open_close: Some(true),
        change: Some(TextDocumentSyncKind::INCREMENTAL),
        save: Some(TextDocumentSyncSaveOptions::SaveOptions(SaveOptions::default())),
        ..TextDocumentSyncOptions::default()
    };
    let triggers = ["(", "[", "?", ":"].map(str::to_string).to_vec();
    ServerCapabilities {
        text_document_sync: Some(TextDocumentSyncCapability::Options(sync)),
        hover_provider: Some(HoverProviderCapability::Simple(true)),
        definition_provider: Some(OneOf::Left(true)),
        completion_provider: Some(CompletionOptions {
            trigger_characters: Some(triggers),
            ..CompletionOptions::default()
        }),
        code_action_provider: Some(CodeActionProviderCapability::Options(CodeActionOptions {
            code_action_kinds: Some(vec![CodeActionKind::QUICKFIX]),
            ..CodeActionOptions::default()
        })),
        document_formatting_provider: Some(OneOf::Left(true)),
        document_symbol_provider: Some(OneOf::Left(true)),
        ..ServerCapabilities::default()
    }
}

fn converse(connection: &Connection) -> Result<(), CommandError> {
    let mut texts = Texts::default();
    let mut told = findings::Told::default();
    for message in &connection.receiver {
        match message {
            Message::Request(request) => {
                if connection.handle_shutdown(&request).map_err(CommandError::broken)? {
                    return Ok(());
                }
                send(connection, Message::Response(answer(&texts, &told, request)))?;
            }
            Message::Notification(notification) => {
                for publish in hear(&mut texts, &mut told, notification) {
                    let params =
                        serde_json::to_value(publish).map_err(|e| CommandError::Bug(e.to_string()))?;
                    let publish = Notification { method: PublishDiagnostics::METHOD.into(), params };
                    send(connection, Message::Notification(publish))?;
                }
            }
            Message::Response(_) => {}
        }
    }
    Ok(())
}

fn send(connection: &Connection, message: Message) -> Result<(), CommandError> {
    connection.sender.send(message).map_err(|_| CommandError::broken("the editor has gone"))
}

/// Handles a notification; returns the findings that follow.
fn hear(
    texts: &mut Texts,
    told: &mut findings::Told,
    notification: Notification,
) -> Vec<PublishDiagnosticsParams> {
    let uri = match notification.method.as_str() {
        DidOpenTextDocument::METHOD => params::<lsp_types::DidOpenTextDocumentParams>(notification.params)
            .map(|p| {
                texts.open(&p.text_document.uri, p.text_document.text);
                p.text_document.uri
            }),
        DidChangeTextDocument::METHOD => {
            params::<lsp_types::DidChangeTextDocumentParams>(notification.params).map(|p| {
                p.content_changes.into_iter().for_each(|change| texts.change(&p.text_document.uri, change));
                p.text_document.uri
            })
        }
        DidSaveTextDocument::METHOD => {
            params::<lsp_types::DidSaveTextDocumentParams>(notification.params).map(|p| p.text_document.uri)
        }
        DidCloseTextDocument::METHOD => {
            let closed = params::<lsp_types::DidCloseTextDocumentParams>(notification.params);
            return closed
                .map(|p| {
                    texts.close(&p.text_document.uri);
                    told.forget(&p.text_document.uri)
                })
                .into_iter()
                .collect();
        }
        _ => None,
    };
    uri.map(|uri| told.after(texts, &uri)).unwrap_or_default()
}

fn params<T: DeserializeOwned>(params: Value) -> Option<T> {
    serde_json::from_value(params)
        .map_err(|e| tracing::warn!("what the editor says is not understood: {e}"))
        .ok()
}

/// Answers a request.
fn answer(texts: &Texts, told: &findings::Told, request: Request) -> Response {
    let method = request.method.clone();
    let unknown = |id| {
        let text = format!("{method} is not served");
        Response::new_err(id, ErrorCode::MethodNotFound as i32, text)
    };
    match request.method.as_str() {
        HoverRequest::METHOD => {
            with::<HoverRequest>(request, |p| words::hover(texts, told, &p.text_document_position_params))
        }
        GotoDefinition::METHOD => {
            with::<GotoDefinition>(request, |p| words::definition(texts, &p.text_document_position_params))
        }
        Completion::METHOD => {
            with::<Completion>(request, |p| words::completion(texts, &p.text_document_position))
        }
        CodeActionRequest::METHOD => with::<CodeActionRequest>(request, |p| Some(mends::actions(p))),
        Formatting::METHOD => with::<Formatting>(request, |p| words::formatting(texts, &p.text_document.uri)),
        DocumentSymbolRequest::METHOD => {
            with::<DocumentSymbolRequest>(request, |p| words::symbols(texts, &p.text_document.uri))
        }
        _ => unknown(request.id),
    }
}

fn with<R: lsp_types::request::Request>(
    request: Request,
    answers: impl FnOnce(&R::Params) -> R::Result,
) -> Response
where
    R::Params: DeserializeOwned,
    R::Result: serde::Serialize,
{
    let id = request.id.clone();
    match request.extract::<R::Params>(R::METHOD) {
        Ok((id, params)) => Response::new_ok(id, answers(&params)),
        Err(ExtractError::JsonError { error, .. }) => {
            Response::new_err(id, ErrorCode::InvalidParams as i32, error.to_string())
        }
        Err(ExtractError::MethodMismatch(request)) => {
            Response::new_err(id, ErrorCode::MethodNotFound as i32, request.method)
        }
    }
}
