//! Reference of file formats: the tables of keys equal the types that read the files.
//!
//! Between `<!-- keys FILE TYPE -->` and `<!-- end -->` a page has the table of a type, after `<!-- ability NAME -->` the words of an
//! ability. `UPDATE_DOCS=1 cargo test -p descry-tests
//! --test reference` writes the tables anew.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use quote::ToTokens;
use syn::punctuated::Punctuated;
use syn::{Attribute, Expr, Fields, Item, ItemEnum, ItemStruct, Lit, Meta, Stmt, Token};

/// Files with the types that read users' files.
const FORMATS: &[&str] = &[
    "domains/src/config.rs",
    "perception/src/recognise/colour.rs",
    "perception/src/recognise/model.rs",
    "robots/src/sim/scene/mod.rs",
    "robots/src/sim/scene/room.rs",
    "robots/src/sim/scene/door.rs",
    "robots/src/sim/scene/surface.rs",
    "robots/src/sim/scene/object.rs",
    "robots/src/sim/shape.rs",
    "robots/src/sim/composed.rs",
    "robots/src/sim/faults.rs",
    "robots/src/sim/stereo.rs",
    "robots/src/sim/light.rs",
    "robots/src/recorded/settings.rs",
    "robots/src/program/hello.rs",
    "robots/src/program/message.rs",
    "experiments/src/kinds/kind.rs",
    "experiments/src/kinds/figure_4.rs",
    "experiments/src/kinds/where_to_look.rs",
    "experiments/src/kinds/faults.rs",
    "experiments/src/kinds/tasks.rs",
    "experiments/src/kinds/tasks/score.rs",
];

/// Types without keys: numbers and texts with special parsers.
const WITHOUT_KEYS: &[&str] = &["Doorway", "NothingSaid", "NumberOrPair", "OtherBody", "Range", "Steps"];

/// Files with the constants used as defaults of keys.
const CONSTANTS: &[&str] = &["domains/src/load.rs", "domains/src/abilities/searching/policies/mod.rs"];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace holds this crate").to_path_buf()
}

fn items(file: &str) -> Vec<Item> {
    let text = fs::read_to_string(root().join(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
    syn::parse_file(&text).unwrap_or_else(|e| panic!("{file}: {e}")).items
}

/// Doc comment of an item, as one line of a table.
fn meaning(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|attribute| match &attribute.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => match &pair.value {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(text) => Some(text.value().trim().to_owned()),
                _ => None,
            },
            _ => None,
        },
        _ => None,
    });
    let text = lines.collect::<Vec<_>>().join(" ").replace('|', "\\|").replace("[`", "`").replace("`]", "`");
    // Where a link of the code leads is nothing for people.
    match text.split_once("`(crate::") {
        Some((before, after)) => format!("{before}`{}", after.split_once(')').map_or("", |(_, rest)| rest)),
        None => text,
    }
}

/// Serde attributes of an item: names, and values of some.
fn told(attributes: &[Attribute]) -> Vec<(String, Option<String>)> {
    let serde = attributes.iter().filter(|attribute| attribute.path().is_ident("serde"));
    let words = serde.flat_map(|attribute| {
        attribute.parse_args_with(Punctuated::<Meta, Token![,]>::parse_terminated).into_iter().flatten()
    });
    words
        .map(|word| {
            let value = match &word {
                Meta::NameValue(pair) => {
                    Some(pair.value.to_token_stream().to_string().trim_matches('"').to_owned())
                }
                _ => None,
            };
            (word.path().to_token_stream().to_string(), value)
        })
        .collect()
}

fn value_of(told: &[(String, Option<String>)], word: &str) -> Option<Option<String>> {
    told.iter().find(|(name, _)| name == word).map(|(_, value)| value.clone())
}

/// Name of an item as written in files.
fn renamed(name: &str, how: Option<&str>) -> String {
    let words = |mark: char| {
        let split = name.chars().enumerate().flat_map(|(n, c)| {
            let gap = (c.is_ascii_uppercase() && n > 0).then_some(mark);
            gap.into_iter().chain([c.to_ascii_lowercase()])
        });
        split.collect::<String>()
    };
    match how {
        Some("snake_case") => words('_'),
        Some("kebab-case") => words('-').replace('_', "-"),
        Some("lowercase") => name.to_lowercase(),
        None => name.to_owned(),
        Some(other) => panic!("{other} is not known here"),
    }
}

/// Type in words.
fn kind(ty: &syn::Type) -> String {
    let text = ty.to_token_stream().to_string().replace(' ', "");
    in_words(&text)
}

fn in_words(text: &str) -> String {
    let within = |outer: &str| text.strip_prefix(outer).and_then(|rest| rest.strip_suffix('>'));
    if let Some(inner) = within("Option<").or_else(|| within("Arc<")) {
        return in_words(inner);
    }
    if let Some(inner) = within("Vec<") {
        return format!("list of {}", several(inner));
    }
    if let Some(inner) = within("BTreeMap<String,") {
        return format!("by name: {}", in_words(inner));
    }
    if let Some((inner, count)) =
        text.strip_prefix('[').and_then(|t| t.strip_suffix(']')).and_then(|t| t.split_once(';'))
    {
        return format!("{count} {}", several(inner));
    }
    match text {
        "f64" | "f32" => "number".into(),
        "usize" | "u64" | "u32" | "u8" | "i64" => "whole number".into(),
        "bool" => "true or false".into(),
        "String" | "PathBuf" => "text".into(),
        "(f64,f64)" => "2 numbers".into(),
        "Vector3<f64>" => "3 numbers".into(),
        "Isometry3<f64>" => "`translation` and `rotation` (a quaternion x, y, z, w)".into(),
        "Point2<f64>" => "2 numbers".into(),
        "Point3<f64>" => "3 numbers".into(),
        "Stamp" => "nanoseconds".into(),
        "Value" | "serde_json::Value" | "serde::de::IgnoredAny" => "anything".into(),
        "OtherBody" => "text".into(),
        "Steps" => "text, or list of texts".into(),
        "Range" => "number, or least and greatest".into(),
        "Colour" => "names or ranges".into(),
        named => format!("`{named}`"),
    }
}

/// Plural of a type in words.
fn several(text: &str) -> String {
    match in_words(text).as_str() {
        one @ ("number" | "whole number" | "text") => format!("{one}s"),
        "2 numbers" => "pairs of numbers".into(),
        one => one.to_owned(),
    }
}

/// Value returned by a default function, in this file or another format file, if short.
fn default_of(here: &[Item], function: &str) -> Option<String> {
    let name = function.rsplit("::").next()?.trim();
    let in_items = |items: &[Item]| {
        let body = items.iter().find_map(|item| match item {
            Item::Fn(item) if item.sig.ident == name => Some(&item.block.stmts),
            _ => None,
        })?;
        match body.as_slice() {
            [Stmt::Expr(value, None)] => short(value),
            _ => None,
        }
    };
    in_items(here).or_else(|| FORMATS.iter().find_map(|file| in_items(&items(file))))
}

/// Value of a constant.
fn constant(name: &str) -> Option<String> {
    let all = CONSTANTS.iter().flat_map(|file| items(file));
    let found = all.filter_map(|item| match item {
        Item::Const(item) if item.ident == name => Some(item.expr.to_token_stream().to_string()),
        _ => None,
    });
    found.last()
}

/// Default variant of an enumeration in one of the format files.
fn default_variant(name: &str) -> Option<String> {
    let found = FORMATS.iter().flat_map(|file| items(file)).find_map(|item| match item {
        Item::Enum(item) if item.ident == name => Some(item),
        _ => None,
    })?;
    let variant = found.variants.iter().find(|v| v.attrs.iter().any(|a| a.path().is_ident("default")))?;
    Some(name_of_variant(&found, variant))
}

/// Name of a variant as written in files.
fn name_of_variant(of: &ItemEnum, variant: &syn::Variant) -> String {
    let how = value_of(&told(&of.attrs), "rename_all").flatten();
    let own = value_of(&told(&variant.attrs), "rename").flatten();
    own.unwrap_or_else(|| renamed(&variant.ident.to_string(), how.as_deref()))
}

/// Value of a field in a type's `Default`.
fn default_field(items: &[Item], of: &str, field: &str) -> Option<String> {
    let own = items.iter().find_map(|item| match item {
        Item::Impl(item) => {
            let is_default = item.trait_.as_ref().is_some_and(|(_, path, _)| path.is_ident("Default"));
            (is_default && item.self_ty.to_token_stream().to_string() == of).then_some(item)
        }
        _ => None,
    })?;
    let body = own.items.iter().find_map(|item| match item {
        syn::ImplItem::Fn(item) => item.block.stmts.last(),
        _ => None,
    })?;
    let Stmt::Expr(Expr::Struct(made), None) = body else { return None };
    let given = made.fields.iter().find(|given| given.member.to_token_stream().to_string() == field)?;
    short(&given.expr)
}

fn short(value: &Expr) -> Option<String> {
    let text = value.to_token_stream().to_string();
    let plain = text
        .replace(".into ()", "")
        .replace(" . ", ".")
        .replace("[ ", "[")
        .replace(" ]", "]")
        .replace(" ,", ",");
    let plain = plain.replace(".into ()", "").replace(".into()", "").replace("- ", "-").replace("vec ! ", "");
    let range = plain.strip_prefix("Range { low : ").and_then(|rest| rest.strip_suffix(" }"));
    let plain = range.map_or(plain.clone(), |pair| format!("[{}]", pair.replace(" high : ", " ")));
    let last = plain.rsplit(":: ").next().unwrap_or_default();
    let plain = constant(last).unwrap_or(plain);
    let is_value = !plain.contains("::") && !plain.contains('(') && plain.len() < 40;
    (is_value && plain != "None").then(|| format!("`{plain}`"))
}

fn table_of_struct(items: &[Item], item: &ItemStruct) -> String {
    let Fields::Named(fields) = &item.fields else { panic!("{} has no named fields", item.ident) };
    let of_all = told(&item.attrs);
    let how = value_of(&of_all, "rename_all").flatten();
    let all_default = value_of(&of_all, "default").is_some();
    let mut text = String::from("| key | what | if left out | meaning |\n|---|---|---|---|\n");
    for field in &fields.named {
        let told = told(&field.attrs);
        let name = field.ident.as_ref().expect("it is named").to_string();
        if value_of(&told, "skip").is_some() || value_of(&told, "flatten").is_some() {
            continue;
        }
        let key = value_of(&told, "rename").flatten().unwrap_or_else(|| renamed(&name, how.as_deref()));
        let optional = field.ty.to_token_stream().to_string().starts_with("Option");
        let left_out = match value_of(&told, "default") {
            Some(Some(function)) => default_of(items, &function).unwrap_or_else(|| "a default".into()),
            Some(None) => none_of(&field.ty),
            None if all_default => {
                default_field(items, &item.ident.to_string(), &name).unwrap_or_else(|| none_of(&field.ty))
            }
            None if optional => "nothing".into(),
            None => "**needed**".into(),
        };
        let meaning = meaning(&field.attrs);
        assert!(!meaning.is_empty(), "nothing says what `{key}` of {} means", item.ident);
        text += &format!("| `{key}` | {} | {left_out} | {meaning} |\n", kind(&field.ty));
    }
    text
}

/// Words for a type's empty value.
fn none_of(ty: &syn::Type) -> String {
    if ty.to_token_stream().to_string().starts_with("Option") {
        return "nothing".into();
    }
    match kind(ty).as_str() {
        "true or false" => "`false`".into(),
        "number" | "whole number" | "nanoseconds" => "`0`".into(),
        "text" => "empty".into(),
        named if named.starts_with('`') => default_variant(named.trim_matches('`'))
            .map_or("what its keys are if left out".into(), |variant| format!("`{variant}`")),
        _ => "none".into(),
    }
}

fn table_of_enum(item: &ItemEnum) -> String {
    let mut text = String::from("| one of | with | meaning |\n|---|---|---|\n");
    for variant in &item.variants {
        let name = name_of_variant(item, variant);
        let is_default = variant.attrs.iter().any(|attribute| attribute.path().is_ident("default"));
        let left_out = if is_default { "; if nothing is said" } else { "" };
        let with: Vec<String> = match &variant.fields {
            Fields::Unit => vec![],
            Fields::Unnamed(fields) => fields.unnamed.iter().map(|field| kind(&field.ty)).collect(),
            Fields::Named(fields) => {
                let named = fields.named.iter().filter_map(|field| Some((field.ident.as_ref()?, &field.ty)));
                named.map(|(name, ty)| format!("`{name}`: {}", kind(ty))).collect()
            }
        };
        let meaning = meaning(&variant.attrs);
        assert!(!meaning.is_empty(), "nothing says what `{name}` of {} means", item.ident);
        text += &format!("| `{name}`{left_out} | {} | {meaning} |\n", with.join(", "));
    }
    text
}

/// Table of a type.
fn table(file: &str, name: &str) -> String {
    let items = items(file);
    let made = items.iter().find_map(|item| match item {
        Item::Struct(item) if item.ident == name => Some(table_of_struct(&items, item)),
        Item::Enum(item) if item.ident == name => Some(table_of_enum(item)),
        _ => None,
    });
    made.unwrap_or_else(|| panic!("{file} has no type {name}"))
}

const BEGIN: &str = "<!-- keys ";
const END: &str = "<!-- end -->";

/// Page with regenerated tables, and the types shown.
fn renewed(page: &str) -> (String, BTreeSet<(String, String)>) {
    let (mut text, mut rest, mut named) = (String::new(), page, BTreeSet::new());
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (head, after) = after.split_once(" -->\n").expect("a table begins with a line of its own");
        let (file, name) = head.split_once(' ').expect("a file and a type are named");
        let (_, after) = after.split_once(END).unwrap_or_else(|| panic!("the table of {name} does not end"));
        text += &format!("{before}{BEGIN}{head} -->\n\n{}\n{END}", table(file, name));
        named.insert((file.into(), name.into()));
        rest = after;
    }
    (text + rest, named)
}

const BEGIN_ABILITY: &str = "<!-- ability ";

/// Tables of the facts, calls and skills of an ability.
fn words_of(name: &str) -> String {
    let ability = descry_domains::abilities::ALL.iter().find(|ability| ability.name == name);
    let ability = ability.unwrap_or_else(|| panic!("there is no ability {name}"));
    let with = |name: &str, types: &[&str]| {
        let types: String = types.iter().map(|of| format!(" {of}")).collect();
        format!("({name}{types})")
    };
    let facts =
        ability.facts.iter().map(|fact| ("fact", with(fact.name, fact.types), fact.about.to_string()));
    let calls = ability.calls.iter().map(|call| ("call", format!("[{}]", call.name), call.about.to_string()));
    let skills =
        ability.skills.iter().map(|skill| ("skill", with(skill.name, skill.types), skill.about.to_string()));
    let traces = ability.traces.iter().map(|trace| {
        let meaning = format!("remembered of `{}`; without it {}", trace.of, trace.without);
        ("reads", with(trace.name, trace.types), meaning)
    });
    let mut text = String::from("| | word | meaning |\n|---|---|---|\n");
    for (what, word, about) in facts.chain(calls).chain(traces).chain(skills) {
        text += &format!("| {what} | `{word}` | {about} |\n");
    }
    text
}

/// Page with regenerated ability tables.
fn with_abilities(page: &str) -> String {
    let (mut text, mut rest) = (String::new(), page);
    while let Some((before, after)) = rest.split_once(BEGIN_ABILITY) {
        let (name, after) = after.split_once(" -->\n").expect("a table begins with a line of its own");
        let (_, after) = after.split_once(END).unwrap_or_else(|| panic!("the table of {name} does not end"));
        text += &format!("{before}{BEGIN_ABILITY}{name} -->\n\n{}\n{END}", words_of(name));
        rest = after;
    }
    text + rest
}

#[test]
fn every_ability_is_on_its_page() {
    let page = fs::read_to_string(root().join("docs/reference/abilities.md")).expect("it is there");
    for ability in descry_domains::abilities::ALL {
        assert!(page.contains(&format!("{BEGIN_ABILITY}{} -->", ability.name)), "{}", ability.name);
    }
}

fn pages() -> Vec<PathBuf> {
    let folder = fs::read_dir(root().join("docs/reference")).expect("there is a reference");
    let mut pages: Vec<PathBuf> = folder.flatten().map(|entry| entry.path()).collect();
    pages.sort();
    pages
}

/// Compares a page with its types, or rewrites it; returns the types shown.
fn check(page: &Path) -> BTreeSet<(String, String)> {
    let text = fs::read_to_string(page).expect("a page is text");
    let (renewed, shown) = renewed(&with_abilities(&text));
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(page, renewed).expect("the page can be written");
    } else {
        let mend = "UPDATE_DOCS=1 cargo test -p descry-tests --test reference";
        assert!(text == renewed, "{} is out of date: {mend}", page.display());
    }
    shown
}

/// True if a field is read from files.
fn is_read(attributes: &[Attribute]) -> bool {
    let derived = attributes.iter().filter(|attribute| attribute.path().is_ident("derive"));
    derived.map(|derive| derive.to_token_stream().to_string()).any(|text| text.contains("Deserialize"))
}

#[test]
fn every_table_is_that_of_its_type_and_every_type_has_one() {
    let shown: BTreeSet<(String, String)> = pages().iter().flat_map(|page| check(page)).collect();
    for file in FORMATS {
        for item in items(file) {
            let (name, attributes) = match &item {
                Item::Struct(item) => (item.ident.to_string(), &item.attrs),
                Item::Enum(item) => (item.ident.to_string(), &item.attrs),
                _ => continue,
            };
            if is_read(attributes) && !WITHOUT_KEYS.contains(&name.as_str()) {
                assert!(
                    shown.contains(&((*file).to_owned(), name.clone())),
                    "no page shows {name} of {file}"
                );
            }
        }
    }
}

/// Types named in a page's tables.
fn named_in(page: &str) -> BTreeSet<String> {
    let rows = page.lines().filter(|line| line.starts_with('|'));
    let what = rows.filter_map(|row| row.split(" | ").nth(1));
    let words = what.flat_map(|what| what.split('`').skip(1).step_by(2));
    words
        .filter(|word| {
            word.starts_with(|c: char| c.is_ascii_uppercase()) && word.chars().all(char::is_alphanumeric)
        })
        .map(str::to_owned)
        .collect()
}

#[test]
fn every_type_that_a_table_names_has_a_table() {
    let texts: Vec<String> =
        pages().iter().map(|page| fs::read_to_string(page).expect("a page is text")).collect();
    let shown: BTreeSet<String> =
        texts.iter().flat_map(|text| renewed(text).1).map(|(_, name)| name).collect();
    let named: BTreeSet<String> = texts.iter().flat_map(|text| named_in(text)).collect();
    let missing: Vec<&String> = named.difference(&shown).collect();
    assert!(!named.is_empty() && missing.is_empty(), "no table shows {missing:?}");
}

/// Names in a list of a file: a constant of pairs that begin with a name.
fn names_in(file: &str, list: &str) -> Vec<String> {
    let found = items(file).into_iter().find_map(|item| match item {
        Item::Const(item) if item.ident == list => Some(*item.expr),
        _ => None,
    });
    let array = match found {
        Some(Expr::Reference(reference)) => *reference.expr,
        Some(other) => other,
        None => panic!("{file} has no list {list}"),
    };
    let Expr::Array(array) = array else { panic!("{list} of {file} is no list") };
    let first = |entry: &Expr| match entry {
        Expr::Tuple(pair) => match &pair.elems[0] {
            Expr::Lit(literal) => match &literal.lit {
                Lit::Str(name) => name.value(),
                _ => panic!("{list} of {file} begins with no text"),
            },
            _ => panic!("{list} of {file} begins with no text"),
        },
        _ => panic!("{list} of {file} has no pairs"),
    };
    array.elems.iter().map(first).collect()
}

#[test]
fn every_name_that_an_experiment_may_say_is_on_its_page() {
    let page = fs::read_to_string(root().join("docs/reference/experiments.md")).expect("it is there");
    for (file, list) in [
        ("domains/src/abilities/searching/policies/mod.rs", "ALL"),
        ("experiments/src/kinds/mod.rs", "ALL"),
        ("experiments/src/kinds/figure_4.rs", "RECOGNISERS"),
    ] {
        for name in names_in(file, list) {
            let is_shown = page.contains(&format!("`{name}`")) || page.contains(&format!("\"{name}\""));
            assert!(is_shown, "{name} of {file} is not in docs/reference/experiments.md");
        }
    }
}

#[test]
fn every_page_is_in_the_table_of_contents() {
    let contents = fs::read_to_string(root().join("docs/SUMMARY.md")).expect("there is a table of contents");
    let folders = ["docs", "docs/reference"];
    for page in
        folders.iter().flat_map(|folder| fs::read_dir(root().join(folder)).expect("it is there").flatten())
    {
        let path = page.path();
        if path.extension().is_some_and(|e| e == "md") && !path.ends_with("SUMMARY.md") {
            let name = path.strip_prefix(root().join("docs")).expect("it lies there").display().to_string();
            assert!(contents.contains(&format!("({name})")), "{name} is not in docs/SUMMARY.md");
        }
    }
}
