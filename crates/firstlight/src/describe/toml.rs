//! TOML to a tree, expression by expression.
//!
//! The parser of the `toml` crate sees one expression at a time, or a few, and what it makes of them goes into the tree
//! at once: of a whole text it makes maps that take more than 1,000 bytes for each table. Which expressions go
//! together, and which say something twice, is decided here, by the rules of TOML 1.0.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use toml::de::{DeTable, DeValue};

use super::node::{Data, Entry, IsArray, Node, ReadText, Span, Syntax, SyntaxFault, quoted, twice};
use super::scan::{Expression, Scan, TextPiece};
use super::write::key;

/// Expressions under one header are parsed together up to so many bytes.
const BATCH: usize = 1 << 14;
/// More errors of the syntax than this are not looked for.
const MAX_FAULTS: usize = 10_000;
/// Of longer expressions only the first error is told: each costs memory.
const ALL_FAULTS: usize = 1 << 16;

/// Reads a text; a table of `is_array` with single brackets is a fault that leaves a tree.
pub(super) fn parse(text: &str, is_array: IsArray<'_>) -> ReadText {
    // What goes beyond the limits is told alone
    let mut scan = Scan::new(text, Syntax::Toml);
    loop {
        match scan.next() {
            Ok(Some(_)) => {}
            Ok(None) => break,
            Err(fault) => return ReadText { root: None, faults: vec![fault] },
        }
    }
    let mut scan = Scan::new(text, Syntax::Toml);
    let mut builder = Builder::new(is_array);
    let mut faults = Vec::new();
    let mut batch = Expression::default();
    while faults.len() <= MAX_FAULTS {
        let next = scan.next().ok().flatten();
        let joins = |next: &Expression| {
            !next.is_header && !batch.is_header && batch.lists.is_empty() && next.range.end - batch.range.start <= BATCH
        };
        match next {
            Some(next) if joins(&next) => {
                batch.range.end = next.range.end;
                batch.lists = next.lists;
            }
            next => {
                read(text, &batch, &mut builder, &mut faults);
                let Some(next) = next else { break };
                batch = next;
            }
        }
    }
    if faults.is_empty() && builder.singles.len() <= MAX_FAULTS {
        let faults = std::mem::take(&mut builder.singles);
        return ReadText { root: Some(builder.finish()), faults };
    }
    faults.append(&mut builder.singles);
    // One slip makes the parser stumble over every word that follows it on the line: tell the first
    faults.sort_by_key(|fault| fault.span.start);
    let (mut line, mut to) = (0usize, 0);
    let mut told = None;
    faults.retain(|fault| {
        let start = fault.span.start.min(text.len());
        line += text.as_bytes()[to..start].iter().filter(|byte| **byte == b'\n').count();
        to = start;
        told.replace(line) != Some(line)
    });
    ReadText { root: None, faults }
}

/// Reads an expression, or several without a header, into the tree.
fn read(text: &str, expression: &Expression, builder: &mut Builder, faults: &mut Vec<SyntaxFault>) {
    let Span { start, end } = expression.range;
    let piece = TextPiece::new(text, expression);
    match DeTable::parse(&piece.text) {
        Ok(table) if expression.is_header => builder.header(table.into_inner(), &piece, faults),
        Ok(table) => {
            let section = builder.section;
            builder.merge(section, table.into_inner(), &piece, faults);
        }
        Err(first) => {
            let all = if end - start <= ALL_FAULTS { DeTable::parse_recoverable(&piece.text).1 } else { vec![first] };
            faults.extend(all.iter().map(|error| {
                let span = error.span().map_or(expression.range, |range| piece.span(range));
                if error.message() == "duplicate key" {
                    let key = text.get(span.start..span.end).unwrap_or_default();
                    return twice(span, key.trim_matches(['"', '\'']));
                }
                SyntaxFault::new(span, format!("not TOML: {}", error.message()), None)
            }));
        }
    }
}

impl TextPiece<'_> {
    fn node(&self, value: toml::Spanned<DeValue<'_>>, keys: &mut Keys) -> Node {
        let span = self.span(value.span());
        let data = match value.into_inner() {
            DeValue::String(s) => Data::String(s.into_owned()),
            DeValue::Integer(i) => match i64::from_str_radix(i.as_str(), i.radix()) {
                Ok(whole) => Data::Number(whole as f64),
                // Digits beyond 64 bits: still a number in base 10
                Err(_) if i.radix() == 10 => Data::Number(i.as_str().parse().unwrap_or(f64::INFINITY)),
                Err(_) => Data::Number(f64::INFINITY),
            },
            DeValue::Float(f) => Data::Number(f.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Boolean(b) => Data::Bool(b),
            DeValue::Datetime(_) => Data::Other("a date or time"),
            DeValue::Array(elements) => match self.list_at(span) {
                Some(numbers) => Data::Numbers(numbers),
                None => Data::Array(elements.into_iter().map(|element| self.node(element, keys)).collect()),
            },
            DeValue::Table(table) => {
                let entry = |(key, value): (toml::Spanned<toml::de::DeString<'_>>, _)| Entry {
                    key_span: self.span(key.span()),
                    key: keys.get(key.get_ref()),
                    value: self.node(value, keys),
                };
                let mut entries: Vec<Entry> = table.into_iter().map(entry).collect();
                // The parser sorts by name; the text's order is the scene's order
                entries.sort_by_key(|e| e.key_span.start);
                Data::Table(entries)
            }
        };
        Node { span, data }
    }
}

/// Every key once.
#[derive(Default)]
struct Keys(HashSet<Arc<str>>);

impl Keys {
    fn get(&mut self, key: &str) -> Arc<str> {
        if let Some(known) = self.0.get(key) {
            return known.clone();
        }
        let key: Arc<str> = key.into();
        self.0.insert(key.clone());
        key
    }
}

/// The tree while it grows.
struct Builder<'a> {
    is_array: IsArray<'a>,
    /// Headers of single brackets where double ones are meant.
    singles: Vec<SyntaxFault>,
    /// The root, and every table that more can be said of.
    tables: Vec<TomlTable>,
    /// The table of the last header.
    section: usize,
    keys: Keys,
}

struct TomlTable {
    items: Vec<TomlItem>,
    made: Made,
    /// Where its keys are, once they are many.
    #[allow(clippy::box_collection, reason = "most tables are small and have none: a word, not six")]
    places: Option<Box<HashMap<Arc<str>, usize>>>,
}

/// How a table came to be.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Made {
    /// By its header.
    Said,
    /// By the header of a table within it.
    OnTheWay,
    /// By a dotted key.
    Dotted,
}

struct TomlItem {
    key: Arc<str>,
    key_span: Span,
    value: TomlValue,
}

enum TomlValue {
    Leaf(Node),
    Table(usize, Span),
    Tables(Vec<(usize, Span)>, Span),
}

/// Tables of more keys find them by a map.
const FEW_KEYS: usize = 16;

impl TomlTable {
    fn find(&self, key: &str) -> Option<usize> {
        match &self.places {
            Some(places) => places.get(key).copied(),
            None => self.items.iter().position(|item| &*item.key == key),
        }
    }

    fn push(&mut self, item: TomlItem) {
        if let Some(places) = &mut self.places {
            places.insert(item.key.clone(), self.items.len());
        } else if self.items.len() == FEW_KEYS {
            let all = self.items.iter().chain([&item]).enumerate();
            self.places = Some(Box::new(all.map(|(i, item)| (item.key.clone(), i)).collect()));
        }
        // Most tables on the way have one
        if self.items.is_empty() {
            self.items.reserve_exact(1);
        }
        self.items.push(item);
    }
}

/// What to say of `[sphere]` in place of `[[sphere]]`.
fn single(span: Span, path: &[Arc<str>]) -> SyntaxFault {
    let path = path.iter().map(|name| key(name)).collect::<Vec<_>>().join(".");
    let kind = path.rsplit('.').next().unwrap_or_default();
    let hint = format!("write [[{path}]] for each {kind}");
    SyntaxFault { span, message: "a table is not an array of tables".into(), hint: Some(hint), path }
}

impl<'a> Builder<'a> {
    fn new(is_array: IsArray<'a>) -> Self {
        let root = TomlTable { items: Vec::new(), made: Made::Said, places: None };
        Builder { is_array, singles: Vec::new(), tables: vec![root], section: 0, keys: Keys::default() }
    }

    fn add_table(&mut self, made: Made) -> usize {
        self.tables.push(TomlTable { items: Vec::new(), made, places: None });
        self.tables.len() - 1
    }

    /// Goes on with the table of a header: the innermost of `header`, which holds nothing.
    fn header(&mut self, header: DeTable<'_>, piece: &TextPiece<'_>, faults: &mut Vec<SyntaxFault>) {
        // What follows a header that cannot be is read all the same, for its errors
        let mut at = 0;
        let mut rest = header;
        let mut path = Vec::new();
        loop {
            let Some((key, value)) = rest.into_iter().next() else { return };
            let (key_span, span) = (piece.span(key.span()), piece.span(value.span()));
            let name = self.keys.get(key.get_ref());
            path.push(name.clone());
            match value.into_inner() {
                DeValue::Table(inner) if inner.is_empty() && (self.is_array)(&path) => {
                    if self.singles.len() <= MAX_FAULTS {
                        self.singles.push(single(span, &path));
                    }
                    self.section = self.say_one_more(at, name, key_span, span, faults);
                    return;
                }
                DeValue::Table(inner) if inner.is_empty() => {
                    self.section = self.say(at, name, key_span, span, faults);
                    return;
                }
                DeValue::Table(inner) => {
                    let Some(next) = self.descend(at, name, key_span, Made::OnTheWay, faults) else {
                        self.section = self.add_table(Made::Said);
                        return;
                    };
                    (at, rest) = (next, inner);
                }
                _ => {
                    self.section = self.say_one_more(at, name, key_span, span, faults);
                    return;
                }
            }
        }
    }

    /// `[name]` in a table.
    fn say(&mut self, at: usize, key: Arc<str>, key_span: Span, span: Span, faults: &mut Vec<SyntaxFault>) -> usize {
        match self.tables[at].find(&key).map(|place| &mut self.tables[at].items[place]) {
            None => {
                let table = self.add_table(Made::Said);
                self.tables[at].push(TomlItem { key, key_span, value: TomlValue::Table(table, span) });
                table
            }
            Some(item) => {
                if let TomlValue::Table(table, old) = &mut item.value {
                    let table = *table;
                    (*old, item.key_span) = (span, key_span);
                    if self.tables[table].made == Made::OnTheWay {
                        self.tables[table].made = Made::Said;
                        return table;
                    }
                }
                faults.push(twice(key_span, &key));
                self.add_table(Made::Said)
            }
        }
    }

    /// `[[name]]` in a table.
    fn say_one_more(
        &mut self,
        at: usize,
        key: Arc<str>,
        key_span: Span,
        span: Span,
        faults: &mut Vec<SyntaxFault>,
    ) -> usize {
        let table = self.add_table(Made::Said);
        match self.tables[at].find(&key) {
            None => {
                self.tables[at].push(TomlItem { key, key_span, value: TomlValue::Tables(vec![(table, span)], span) })
            }
            Some(place) => match &mut self.tables[at].items[place].value {
                TomlValue::Tables(tables, _) => tables.push((table, span)),
                _ => faults.push(twice(key_span, &key)),
            },
        }
        table
    }

    /// The table of that name in a table; of an array of tables the last.
    fn descend(
        &mut self,
        at: usize,
        key: Arc<str>,
        key_span: Span,
        made: Made,
        faults: &mut Vec<SyntaxFault>,
    ) -> Option<usize> {
        let Some(place) = self.tables[at].find(&key) else {
            let table = self.add_table(made);
            self.tables[at].push(TomlItem { key, key_span, value: TomlValue::Table(table, key_span) });
            return Some(table);
        };
        match &self.tables[at].items[place].value {
            TomlValue::Table(table, _) => {
                let table = *table;
                if made == Made::Dotted {
                    // A table with a header of its own takes no more from elsewhere
                    if self.tables[table].made == Made::Said {
                        faults.push(twice(key_span, &key));
                        return None;
                    }
                    self.tables[table].made = Made::Dotted;
                }
                Some(table)
            }
            TomlValue::Tables(tables, _) => {
                let last = tables.last().map(|(table, _)| *table);
                if made == Made::Dotted {
                    faults.push(twice(key_span, &key));
                    return None;
                }
                last
            }
            TomlValue::Leaf(node) => {
                let kind = node.kind();
                let message = format!("not TOML: {} is {kind} already, and takes no keys here", quoted(&key));
                faults.push(SyntaxFault::new(key_span, message, None));
                None
            }
        }
    }

    /// Adds keys and their values to a table.
    fn merge(&mut self, at: usize, from: DeTable<'_>, piece: &TextPiece<'_>, faults: &mut Vec<SyntaxFault>) {
        // In the order of the text, in which places are told, not that of names
        let mut from: Vec<_> = from.into_iter().collect();
        from.sort_by_key(|(key, _)| key.span().start);
        for (key, value) in from {
            let key_span = piece.span(key.span());
            let range = value.span();
            // A table of a dotted key stands at its key, another at its brace
            let is_dotted = value.get_ref().is_table() && piece.text.as_bytes().get(range.start) != Some(&b'{');
            let name = self.keys.get(key.get_ref());
            if is_dotted {
                if let Some(table) = self.descend(at, name, key_span, Made::Dotted, faults)
                    && let DeValue::Table(inner) = value.into_inner()
                {
                    self.merge(table, inner, piece, faults);
                }
            } else if self.tables[at].find(&name).is_some() {
                faults.push(twice(key_span, &name));
            } else {
                let value = TomlValue::Leaf(piece.node(value, &mut self.keys));
                self.tables[at].push(TomlItem { key: name, key_span, value });
            }
        }
    }

    fn finish(mut self) -> Node {
        self.node(0, Span::default())
    }

    fn node(&mut self, table: usize, span: Span) -> Node {
        let TomlTable { items, .. } =
            std::mem::replace(&mut self.tables[table], TomlTable { items: Vec::new(), made: Made::Said, places: None });
        let entry = |TomlItem { key, key_span, value }| {
            let value = match value {
                TomlValue::Leaf(node) => node,
                TomlValue::Table(table, span) => self.node(table, span),
                TomlValue::Tables(tables, span) => {
                    let elements = tables.into_iter().map(|(table, span)| self.node(table, span)).collect();
                    Node { span, data: Data::Array(elements) }
                }
            };
            Entry { key, key_span, value }
        };
        let mut entries: Vec<Entry> = items.into_iter().map(entry).collect();
        // A table that was on the way stands where its own header is
        entries.sort_by_key(|entry| entry.key_span.start);
        Node { span, data: Data::Table(entries) }
    }
}
