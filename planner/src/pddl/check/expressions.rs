//! Checks of terms and numeric expressions: numbers of arguments and types. Object functions are
//! distinguished from numeric ones by their result types.

use super::conditions::constant;
use super::{Checker, Scope};
use crate::attachment::CallKind;
use crate::diagnostic::{Diagnostic, Span};
use crate::pddl::ast::{self, Arithmetic, Name};
use crate::task::{
    CallTerm, Expression, Fluent, FunctionId, Parameter, PredicateId, PreferenceId, Term, TypeId,
};

/// Value of a checked term.
pub(super) enum Value {
    /// Object, with its possible types.
    Object(Term, Vec<TypeId>),
    /// Number.
    Number(Expression),
    /// The name `undefined`.
    Undefined,
}

/// Context of an expression, which determines what may have a value there besides functions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Condition or goal.
    Condition,
    /// Effect of an instantaneous action.
    Effect,
    /// Condition or effect of a durative action, where `?duration` has a value.
    Durative,
    /// Bound on `?duration`, where `?duration` itself has no value yet.
    Bound,
    /// Metric, where `total-time` and `is-violated` have values.
    Metric,
}

pub(super) fn span_of(term: &ast::TermAst) -> Span {
    match term {
        ast::TermAst::Name(name)
        | ast::TermAst::Variable(name)
        | ast::TermAst::Number(_, name)
        | ast::TermAst::Violated(name) => name.span,
        ast::TermAst::Apply { span, .. } | ast::TermAst::Arithmetic { span, .. } => *span,
        ast::TermAst::Call(call) => call.span,
        ast::TermAst::Duration(span) | ast::TermAst::ContinuousTime(span) | ast::TermAst::TotalTime(span) => {
            *span
        }
    }
}

impl Checker<'_> {
    /// Checks a term that must be an object; returns the term and its possible types.
    pub(super) fn object_term(&mut self, term: &ast::TermAst, scope: &Scope) -> Option<(Term, Vec<TypeId>)> {
        match term {
            ast::TermAst::Variable(name) => match scope.find(name.symbol) {
                Some(variable) => Some((Term::Variable(variable.slot), variable.types.clone())),
                None => {
                    self.unknown_variable(*name, scope);
                    None
                }
            },
            ast::TermAst::Name(name) | ast::TermAst::Number(_, name) => {
                if self.objects[name.symbol.0 as usize].is_none() && self.functions.contains_key(&name.symbol)
                {
                    return self.object_function(*name, &[], name.span, scope);
                }
                if let Some(variable) = self.without_question_mark(*name, scope) {
                    return Some(variable);
                }
                let id = self.find_object(*name)?;
                Some((Term::Object(id), self.task.object(id).types.clone()))
            }
            ast::TermAst::Apply { name, arguments, span } => {
                self.object_function(*name, arguments, *span, scope)
            }
            other => {
                let span = span_of(other);
                self.push(Diagnostic::error(
                    "wrong-kind",
                    "a number where an object belongs",
                    span,
                    "this is a number",
                ));
                None
            }
        }
    }

    fn object_function(
        &mut self,
        name: Name,
        arguments: &[ast::TermAst],
        span: Span,
        scope: &Scope,
    ) -> Option<(Term, Vec<TypeId>)> {
        let fluent = self.fluent(name, arguments, span, scope)?;
        match self.task.function(fluent.function).result.clone() {
            Some(types) => Some((Term::Function(Box::new(fluent)), types)),
            None => {
                let declared = self.task.function(fluent.function).span;
                let message =
                    format!("the value of `{}` is a number, an object was expected", self.name(name.symbol));
                self.push(
                    Diagnostic::error("wrong-kind", message, span, "this is a number")
                        .with_label(declared, "declared here"),
                );
                None
            }
        }
    }

    /// Checks a function with its arguments.
    pub(super) fn fluent(
        &mut self,
        name: Name,
        arguments: &[ast::TermAst],
        span: Span,
        scope: &Scope,
    ) -> Option<Fluent> {
        let function = self.find_function(name)?;
        let parameters = self.task.function(function).parameters.clone();
        let declared = self.task.function(function).span;
        let arguments = self.arguments("function", name, &parameters, declared, arguments, span, scope)?;
        Some(Fluent { function, arguments, span })
    }

    /// Checks the arguments of a predicate.
    pub(super) fn predicate_arguments(
        &mut self,
        predicate: PredicateId,
        name: Name,
        arguments: &[ast::TermAst],
        span: Span,
        scope: &Scope,
    ) -> Option<Vec<Term>> {
        let parameters = self.task.predicate(predicate).parameters.clone();
        let declared = self.task.predicate(predicate).span;
        self.arguments("predicate", name, &parameters, declared, arguments, span, scope)
    }

    /// Checks a call of a module, which must be of the given kind.
    pub(super) fn call(&mut self, call: &ast::CallAst, kind: CallKind, scope: &Scope) -> Option<CallTerm> {
        let module = self.find_module(call.name)?;
        let known = self.task.module(module);
        let (declared, parameters, is) = (known.span, known.parameters.clone(), known.kind);
        if is != kind {
            let written = self.written(call.name.span).to_string();
            let message = format!("module `{written}` is {}, {} was expected", article(is), article(kind));
            let help = match kind {
                CallKind::Condition => "in conditions stand calls of modules of kind `conditionchecker`",
                CallKind::Cost => "durations and costs are calls of modules of kind `cost`",
                CallKind::Effect => "in effects stand calls of modules of kind `effect`",
                CallKind::Grounding => "after `:grounding` stand calls of modules of kind `grounding`",
            };
            self.push(
                Diagnostic::error(
                    "wrong-kind",
                    message,
                    call.span,
                    format!("{} was expected", article(kind)),
                )
                .with_label(declared, "declared here")
                .with_help(help),
            );
            return None;
        }
        let arguments =
            self.arguments("module", call.name, &parameters, declared, &call.arguments, call.span, scope)?;
        Some(CallTerm { module, arguments, span: call.span })
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "one place that words findings on arguments of all three kinds"
    )]
    fn arguments(
        &mut self,
        kind: &str,
        name: Name,
        parameters: &[Parameter],
        declared: Span,
        arguments: &[ast::TermAst],
        span: Span,
        scope: &Scope,
    ) -> Option<Vec<Term>> {
        let terms: Vec<Option<(Term, Vec<TypeId>)>> =
            arguments.iter().map(|argument| self.object_term(argument, scope)).collect();
        if arguments.len() != parameters.len() {
            let (wanted, found) = (parameters.len(), arguments.len());
            self.wrong_arity(kind, name, declared, (wanted, found), span);
            return None;
        }
        let mut list = Vec::with_capacity(terms.len());
        for ((term, parameter), written) in terms.into_iter().zip(parameters).zip(arguments) {
            let (term, types) = term?;
            let fits = match &term {
                Term::Object(id) => self.task.fits(*id, &parameter.types),
                _ => self.overlap(&types, &parameter.types),
            };
            if !fits {
                let fitting = scope.variables.iter().filter(|own| self.overlap(&own.types, &parameter.types));
                let fitting: Vec<&str> = fitting.map(|own| self.name(own.symbol)).collect();
                let help = (!fitting.is_empty()).then(|| format!("of that type here: {}", fitting.join(" ")));
                self.wrong_type(kind, name, parameter, &types, span_of(written), help);
            }
            list.push(term);
        }
        Some(list)
    }

    pub(super) fn wrong_arity(
        &mut self,
        kind: &str,
        name: Name,
        declared: Span,
        (wanted, found): (usize, usize),
        span: Span,
    ) {
        let written = self.name(name.symbol);
        // Of a name that is only guessed, that finding says enough.
        if !self.written(declared).eq_ignore_ascii_case(written) {
            return;
        }
        let plural = if wanted == 1 { "argument" } else { "arguments" };
        let message = format!("{kind} `{written}` takes {wanted} {plural}, found {found}");
        let difference = if found > wanted {
            format!("{} too many", found - wanted)
        } else {
            format!("{} missing", wanted - found)
        };
        let head = self.written(declared_list(self, declared)).to_string();
        self.push(
            Diagnostic::error("arity", message, span, difference)
                .with_label(declared, "declared here")
                .with_help(format!("its declaration is `{}`", crate::pddl::parse::shortened(&head))),
        );
    }

    pub(super) fn wrong_type(
        &mut self,
        kind: &str,
        name: Name,
        parameter: &Parameter,
        found: &[TypeId],
        span: Span,
        help: Option<String>,
    ) {
        let (wanted, is) = (self.types_text(&parameter.types), self.types_text(found));
        let name = self.name(name.symbol);
        let message =
            format!("{kind} `{name}` takes {} of type `{wanted}`, found type `{is}`", parameter.name);
        let finding = Diagnostic::error("wrong-type", message, span, format!("this is of type `{is}`"))
            .with_label(parameter.span, format!("type `{wanted}` is asked for here"));
        let help =
            help.unwrap_or_else(|| "use another one here, or change one of the two declarations".to_string());
        self.push(finding.with_help(help));
    }

    /// Checks a term that may be an object or a number.
    pub(super) fn value(&mut self, term: &ast::TermAst, place: Place, scope: &Scope) -> Option<Value> {
        let object = |(term, types)| Value::Object(term, types);
        match term {
            ast::TermAst::Variable(_) => self.object_term(term, scope).map(object),
            ast::TermAst::Name(name) if self.objects[name.symbol.0 as usize].is_some() => {
                self.object_term(term, scope).map(object)
            }
            ast::TermAst::Name(name) if self.name(name.symbol) == "undefined" => Some(Value::Undefined),
            ast::TermAst::Name(name) if !self.functions.contains_key(&name.symbol) => {
                self.object_term(term, scope).map(object)
            }
            ast::TermAst::Name(name) => self.function_value(*name, &[], name.span, scope),
            ast::TermAst::Apply { name, arguments, span } => {
                self.function_value(*name, arguments, *span, scope)
            }
            _ => self.expression(term, place, scope).map(Value::Number),
        }
    }

    fn function_value(
        &mut self,
        name: Name,
        arguments: &[ast::TermAst],
        span: Span,
        scope: &Scope,
    ) -> Option<Value> {
        let fluent = self.fluent(name, arguments, span, scope)?;
        Some(match self.task.function(fluent.function).result.clone() {
            Some(types) => Value::Object(Term::Function(Box::new(fluent)), types),
            None => Value::Number(Expression::Fluent(fluent)),
        })
    }

    /// Checks a numeric expression.
    pub(super) fn expression(
        &mut self,
        term: &ast::TermAst,
        place: Place,
        scope: &Scope,
    ) -> Option<Expression> {
        match term {
            ast::TermAst::Number(number, _) => Some(Expression::Number(*number)),
            ast::TermAst::Arithmetic { operator, operands, .. } => {
                self.arithmetic(*operator, operands, place, scope)
            }
            ast::TermAst::Call(call) => self.call(call, CallKind::Cost, scope).map(Expression::Call),
            ast::TermAst::Duration(span) => {
                if place == Place::Durative {
                    return Some(Expression::Duration);
                }
                let finding = match place {
                    Place::Bound => {
                        let message = "a bound of `?duration` cannot depend on `?duration`";
                        let help = "bound it by other numbers: `(<= ?duration 3)` in place of `(<= ?duration (/ 9 ?duration))`";
                        Diagnostic::error("duration", message, *span, "this is what is bounded")
                            .with_help(help)
                    }
                    _ => {
                        let message = "`?duration` has a value in durative actions alone";
                        Diagnostic::error("duration", message, *span, "nothing here takes time")
                    }
                };
                self.push(finding);
                None
            }
            ast::TermAst::ContinuousTime(span) => {
                let message = "`#t` stands only in a change at a rate";
                let help =
                    "as in `(increase (fuel ?r) (* #t 2))`, an effect of a durative action without a time";
                self.push(Diagnostic::error("continuous", message, *span, "not here").with_help(help));
                None
            }
            ast::TermAst::TotalTime(span) => self.total_time(*span, place),
            ast::TermAst::Violated(name) => self.violated(*name, place),
            _ => match self.value(term, place, scope)? {
                Value::Number(expression) => Some(expression),
                Value::Object(_, types) => {
                    let message = format!("a number was expected, found a `{}`", self.types_text(&types));
                    self.push(Diagnostic::error("wrong-kind", message, span_of(term), "this is an object"));
                    None
                }
                Value::Undefined => {
                    let message = "`undefined` is no number";
                    self.push(Diagnostic::error(
                        "wrong-kind",
                        message,
                        span_of(term),
                        "a number was expected",
                    ));
                    None
                }
            },
        }
    }

    fn arithmetic(
        &mut self,
        operator: Arithmetic,
        operands: &[ast::TermAst],
        place: Place,
        scope: &Scope,
    ) -> Option<Expression> {
        let all: Vec<Option<Expression>> =
            operands.iter().map(|operand| self.expression(operand, place, scope)).collect();
        let mut all: Vec<Expression> = all.into_iter().collect::<Option<_>>()?;
        Some(match operator {
            Arithmetic::Add => Expression::Add(all),
            Arithmetic::Multiply => Expression::Multiply(all),
            Arithmetic::Subtract if all.len() == 1 => Expression::Negative(Box::new(all.pop()?)),
            Arithmetic::Subtract | Arithmetic::Divide => {
                let (right, left) = (all.pop()?, all.pop()?);
                if operator == Arithmetic::Divide {
                    self.divides(&right, operands.last().map(span_of).unwrap_or_default());
                }
                let both = Box::new([left, right]);
                if operator == Arithmetic::Divide {
                    Expression::Divide(both)
                } else {
                    Expression::Subtract(both)
                }
            }
        })
    }

    /// Reports a division by a constant zero.
    pub(super) fn divides(&mut self, divisor: &Expression, span: Span) {
        if constant(divisor) == Some(0.0) {
            let finding =
                Diagnostic::warning("division-by-zero", "a division by zero", span, "this is always zero");
            self.push(finding.with_help("what has no value fulfils no condition, and no action may take it"));
        }
    }

    fn total_time(&mut self, span: Span, place: Place) -> Option<Expression> {
        if place == Place::Metric {
            return Some(Expression::TotalTime);
        }
        // A domain may have a function of this name.
        if let Some(&function) =
            self.symbols.find("total-time").and_then(|symbol| self.functions.get(&symbol))
        {
            return Some(Expression::Fluent(Fluent {
                function: FunctionId(function),
                arguments: Vec::new(),
                span,
            }));
        }
        let message = "`total-time` has a value in the metric alone";
        self.push(Diagnostic::error("wrong-kind", message, span, "not known while the plan runs"));
        None
    }

    fn violated(&mut self, name: Name, place: Place) -> Option<Expression> {
        if place != Place::Metric {
            let message = "`is-violated` has a value in the metric alone";
            self.push(Diagnostic::error("wrong-kind", message, name.span, "not known while the plan runs"));
            return None;
        }
        if let Some(&id) = self.preferences.get(&name.symbol) {
            return Some(Expression::Violated(PreferenceId(id)));
        }
        // A preference over the parameters of an action that does not exist counts nothing; one that is misspelt is
        // a fault.
        let known: Vec<&str> = self.task.preferences.iter().map(|own| own.name.as_str()).collect();
        let message = format!("no preference is called `{}`", self.name(name.symbol));
        let near = crate::pddl::nearest(self.name(name.symbol), known.iter().copied());
        let finding = Diagnostic::error("undeclared-preference", message, name.span, "unknown preference");
        let finding = match near {
            Some(near) => finding.with_help(format!("did you mean `{near}`?")),
            None => finding,
        };
        self.push(finding);
        None
    }
}

fn article(kind: CallKind) -> &'static str {
    match kind {
        CallKind::Cost => "a cost module",
        CallKind::Condition => "a condition module",
        CallKind::Effect => "an effect module",
        CallKind::Grounding => "a grounding module",
    }
}

/// Span of the parenthesised list in which a declared name comes first.
fn declared_list(checker: &Checker<'_>, name: Span) -> Span {
    let text = checker.task.sources.get(name.source as usize).map_or("", |source| source.text.as_str());
    let start = text[..name.start as usize].rfind('(').unwrap_or(name.start as usize);
    let mut depth = 0usize;
    for (offset, byte) in text.bytes().enumerate().skip(start) {
        match byte {
            b'(' => depth += 1,
            b')' => depth = depth.saturating_sub(1),
            _ => continue,
        }
        if depth == 0 {
            return Span { source: name.source, start: start as u32, end: offset as u32 + 1 };
        }
    }
    name
}
