//! A text to tokens, each with its place.

use std::ops::Range;

use super::error::ExpressionError;

/// A token.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    Whole(i64),
    Real(f64),
    Name { text: String, is_quoted: bool },
    Symbol(&'static str),
    End,
}

/// What a wrong sign was meant to be; `None` where the sign is right. Longer ones stand first, so that the first that
/// matches is the one.
const SYMBOLS: &[(&str, Option<&str>)] = &[
    ("===", Some("equality is ==")),
    ("==", None),
    ("!=", None),
    ("<>", Some("inequality is !=")),
    ("=>", Some("at least is >=")),
    ("=<", Some("at most is <=")),
    ("<=", None),
    (">=", None),
    ("&&", None),
    ("||", None),
    ("**", Some("there is no power: multiply, as in x*x")),
    ("^", Some("there is no power: multiply, as in x*x")),
    ("=", Some("a single = compares nothing: equality is ==")),
    ("&", Some("'and' is && or and")),
    ("|", Some("'or' is || or or")),
    ("~", Some("'not' is ! or not")),
    ("≤", Some("at most is <=")),
    ("≥", Some("at least is >=")),
    ("≠", Some("inequality is !=")),
    ("×", Some("multiplication is *")),
    ("·", Some("multiplication is *")),
    ("−", Some("minus is -")),
    ("$", Some("names of attributes stand by themselves: density, not $density")),
    ("@", Some("names of attributes stand by themselves: density, not @density")),
    ("`", Some("names are quoted by \" or '")),
    ("{", Some("a list stands in parentheses: type in (0, 1)")),
    ("<", None),
    (">", None),
    ("!", None),
    ("+", None),
    ("-", None),
    ("*", None),
    ("/", None),
    ("%", None),
    ("(", None),
    (")", None),
    ("[", None),
    ("]", None),
    (",", None),
    (".", None),
];

/// All tokens, `End` last.
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, Range<usize>)>, ExpressionError> {
    let mut tokens = Vec::new();
    let mut at = 0;
    loop {
        at += text[at..].len() - text[at..].trim_start().len();
        let rest = &text[at..];
        let Some(first) = rest.chars().next() else {
            tokens.push((Token::End, at..at));
            return Ok(tokens);
        };
        let (token, length) = if first.is_ascii_digit() || begins_with_fraction(rest) {
            number(text, at)?
        } else if first.is_alphabetic() || first == '_' {
            let length = rest.find(|c: char| !is_of_name(c)).unwrap_or(rest.len());
            name(&rest[..length])
        } else if matches!(first, '"' | '\'') {
            quoted(text, at, first)?
        } else {
            symbol(text, at, first)?
        };
        tokens.push((token, at..at + length));
        at += length;
    }
}

fn is_of_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

fn begins_with_fraction(text: &str) -> bool {
    text.starts_with('.') && text[1..].starts_with(|c: char| c.is_ascii_digit())
}

/// A name, or one of the words that join and compare.
fn name(word: &str) -> (Token, usize) {
    let token = match word {
        "and" | "AND" => Token::Symbol("&&"),
        "or" | "OR" => Token::Symbol("||"),
        "not" | "NOT" => Token::Symbol("not"),
        "in" | "IN" => Token::Symbol("in"),
        _ => Token::Name { text: word.to_owned(), is_quoted: false },
    };
    (token, word.len())
}

fn quoted(text: &str, at: usize, quote: char) -> Result<(Token, usize), ExpressionError> {
    let inner = &text[at + 1..];
    match inner.find(quote) {
        Some(0) => Err(ExpressionError::new(text, at..at + 2, "there is no name between the quotes")),
        Some(end) => Ok((Token::Name { text: inner[..end].to_owned(), is_quoted: true }, end + 2)),
        None => Err(ExpressionError::new(text, at..text.len(), format!("the name has no closing {quote}"))),
    }
}

fn number(text: &str, at: usize) -> Result<(Token, usize), ExpressionError> {
    let rest = &text.as_bytes()[at..];
    let digits = |from: usize| rest[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut length = digits(0);
    let mut is_whole = true;
    if rest.get(length) == Some(&b'.') {
        length += 1;
        length += digits(length);
        is_whole = false;
    }
    if matches!(rest.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(rest.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits((length + 1 + sign).min(rest.len()));
        if exponent > 0 {
            length += 1 + sign + exponent;
            is_whole = false;
        }
    }
    let place = at..at + length;
    let glued = text[place.end..].find(|c: char| !is_of_name(c)).unwrap_or(text.len() - place.end);
    if glued > 0 {
        let what = "a number runs into a name: put a sign between them, or the name in quotes";
        return Err(ExpressionError::new(text, at..place.end + glued, what));
    }
    let digits = &text[place.clone()];
    if is_whole && let Ok(whole) = digits.parse() {
        return Ok((Token::Whole(whole), length));
    }
    match digits.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok((Token::Real(value), length)),
        _ => Err(ExpressionError::new(text, place, "the number is too large for double precision")),
    }
}

fn symbol(text: &str, at: usize, first: char) -> Result<(Token, usize), ExpressionError> {
    match SYMBOLS.iter().find(|(symbol, _)| text[at..].starts_with(symbol)) {
        Some((symbol, None)) => Ok((Token::Symbol(symbol), symbol.len())),
        Some((symbol, Some(meant))) => Err(ExpressionError::new(text, at..at + symbol.len(), *meant)),
        None => {
            let message = format!("'{first}' means nothing here: a name that has it is written in quotes");
            Err(ExpressionError::new(text, at..at + first.len_utf8(), message))
        }
    }
}
