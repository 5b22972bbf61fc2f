//! Tokens to a tree, by recursive descent. What is a comparison and what a number is settled here.

use std::ops::Range;

use super::error::ExpressionError;
use super::lexer::{Token, tokens};

/// Deeper trees are refused: nothing that a person writes comes near, and each level takes stack.
const MAX_DEPTH: usize = 200;

/// A part of an expression and its place in the text.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) kind: Kind,
    pub(super) place: Range<usize>,
    depth: usize,
}

/// Kinds of parts.
#[derive(Debug, Clone)]
pub(super) enum Kind {
    Whole(i64),
    Real(f64),
    Name(Name),
    Negate(Box<Node>),
    Arithmetic(Arithmetic, Box<[Node; 2]>),
    Call(Function, Vec<Node>),
    Compare(Relation, Box<[Node; 2]>),
    In { value: Box<Node>, list: Vec<Node>, is_negated: bool },
    Not(Box<Node>),
    And(Box<[Node; 2]>),
    Or(Box<[Node; 2]>),
}

/// An attribute, or a component of it.
#[derive(Debug, Clone)]
pub(super) struct Name {
    pub(super) text: String,
    pub(super) is_quoted: bool,
    /// From 0.
    pub(super) component: Option<usize>,
}

impl Name {
    /// Whether it is one of the file's attributes, and not what every particle has.
    pub(super) fn is_attribute(&self) -> bool {
        self.is_quoted || !matches!(self.text.as_str(), "x" | "y" | "z" | "position" | "index")
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Arithmetic {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Relation {
    Equal,
    Unequal,
    Less,
    LessOrEqual,
    Greater,
    GreaterOrEqual,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Function {
    Abs,
    Min,
    Max,
    Length,
}

impl Node {
    fn children(&self) -> Vec<&Node> {
        match &self.kind {
            Kind::Whole(_) | Kind::Real(_) | Kind::Name(_) => Vec::new(),
            Kind::Negate(inner) | Kind::Not(inner) => vec![&**inner],
            Kind::Arithmetic(_, pair) | Kind::Compare(_, pair) | Kind::And(pair) | Kind::Or(pair) => {
                pair.iter().collect()
            }
            Kind::Call(_, nodes) => nodes.iter().collect(),
            Kind::In { value, list, .. } => std::iter::once(&**value).chain(list).collect(),
        }
    }

    /// Calls `see` with this node and all below, from left to right.
    pub(super) fn visit<'a>(&'a self, see: &mut impl FnMut(&'a Node)) {
        see(self);
        for child in self.children() {
            child.visit(see);
        }
    }

    fn is_test(&self) -> bool {
        matches!(self.kind, Kind::Compare(..) | Kind::In { .. } | Kind::Not(_) | Kind::And(_) | Kind::Or(_))
    }
}

/// Reads all of the text as one condition.
pub(super) fn parse(text: &str) -> Result<Node, ExpressionError> {
    let mut parser = Parser { text, tokens: tokens(text)?, at: 0, depth: 0 };
    if parser.tokens.len() == 1 {
        return Err(parser.fail(0..0, "the expression is empty: write a condition such as type == 0"));
    }
    let root = parser.any()?;
    if !matches!(parser.peek(), Token::End) {
        return Err(parser.unexpected());
    }
    parser.test(root)
}

struct Parser<'a> {
    text: &'a str,
    tokens: Vec<(Token, Range<usize>)>,
    at: usize,
    /// Of the functions that call each other.
    depth: usize,
}

type Parsed = Result<Node, ExpressionError>;

impl Parser<'_> {
    fn fail(&self, place: Range<usize>, message: impl Into<String>) -> ExpressionError {
        ExpressionError::new(self.text, place, message)
    }

    fn peek(&self) -> &Token {
        &self.tokens[self.at].0
    }

    fn place(&self) -> Range<usize> {
        self.tokens[self.at].1.clone()
    }

    /// Moves on, but never beyond the end.
    fn advance(&mut self) {
        self.at = (self.at + 1).min(self.tokens.len() - 1);
    }

    fn take(&mut self, symbol: &str) -> bool {
        let is_there = matches!(self.peek(), Token::Symbol(s) if *s == symbol);
        if is_there {
            self.advance();
        }
        is_there
    }

    fn expect(&mut self, symbol: &str, why: &str) -> Result<(), ExpressionError> {
        if self.take(symbol) { Ok(()) } else { Err(self.fail(self.place(), format!("a {symbol} is missing {why}"))) }
    }

    fn unexpected(&self) -> ExpressionError {
        let message = match self.peek() {
            Token::End => "the expression ends too early: a name, a number or a ( is missing".to_owned(),
            Token::Symbol(")") => "this ) closes nothing".to_owned(),
            Token::Symbol("[") => "a component follows an attribute directly: velocity[0]".to_owned(),
            Token::Symbol(symbol) => format!("'{symbol}' cannot stand here"),
            _ => "an operator is missing before this: == < > + - * / and or …".to_owned(),
        };
        self.fail(self.place(), message)
    }

    fn node(&self, kind: Kind, start: usize) -> Parsed {
        // The token before is the last one taken.
        let end = self.tokens[self.at.saturating_sub(1)].1.end;
        let mut node = Node { kind, place: start..end, depth: 0 };
        node.depth = 1 + node.children().iter().map(|child| child.depth).max().unwrap_or(0);
        if node.depth > MAX_DEPTH {
            return Err(self.too_deep(node.place));
        }
        Ok(node)
    }

    fn too_deep(&self, place: Range<usize>) -> ExpressionError {
        self.fail(
            place,
            format!("more than {MAX_DEPTH} levels of operations: shorten it; many values fit a list, id in (1, 2)"),
        )
    }

    /// Requires a condition.
    fn test(&self, node: Node) -> Parsed {
        if node.is_test() {
            return Ok(node);
        }
        let shown = &self.text[node.place.clone()];
        let message = format!("this is a number, and a condition is wanted: compare it, as in {shown} != 0");
        Err(self.fail(node.place, message))
    }

    /// Requires a number.
    fn number(&self, node: Node) -> Parsed {
        if node.is_test() {
            return Err(
                self.fail(node.place, "this is a condition, and a number is wanted: join conditions by and, or")
            );
        }
        Ok(node)
    }

    /// A condition or a number, whatever comes.
    fn any(&mut self) -> Parsed {
        // A level of parentheses is a few calls deep.
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            return Err(self.too_deep(self.place()));
        }
        let found = self.or();
        self.depth -= 1;
        found
    }

    fn or(&mut self) -> Parsed {
        let start = self.place().start;
        let mut left = self.and()?;
        while self.take("||") {
            let right = self.and()?;
            left = self.node(Kind::Or(Box::new([self.test(left)?, self.test(right)?])), start)?;
        }
        Ok(left)
    }

    fn and(&mut self) -> Parsed {
        let start = self.place().start;
        let mut left = self.not()?;
        while self.take("&&") {
            let right = self.not()?;
            left = self.node(Kind::And(Box::new([self.test(left)?, self.test(right)?])), start)?;
        }
        Ok(left)
    }

    fn not(&mut self) -> Parsed {
        let start = self.place().start;
        let mut count = 0;
        while self.take("not") {
            count += 1;
        }
        let inner = self.comparison()?;
        self.negations(inner, count, start)
    }

    fn negations(&mut self, mut inner: Node, count: usize, start: usize) -> Parsed {
        for _ in 0..count {
            inner = self.node(Kind::Not(Box::new(self.test(inner)?)), start)?;
        }
        Ok(inner)
    }

    fn relation(&self) -> Option<Relation> {
        let Token::Symbol(symbol) = self.peek() else { return None };
        Some(match *symbol {
            "==" => Relation::Equal,
            "!=" => Relation::Unequal,
            "<" => Relation::Less,
            "<=" => Relation::LessOrEqual,
            ">" => Relation::Greater,
            ">=" => Relation::GreaterOrEqual,
            _ => return None,
        })
    }

    /// `a`, `a < b`, `a < b < c`, `a in (…)`.
    fn comparison(&mut self) -> Parsed {
        let start = self.place().start;
        let mut left = self.sum()?;
        let is_negated = matches!(self.peek(), Token::Symbol("not"));
        if is_negated {
            self.advance();
            if !matches!(self.peek(), Token::Symbol("in")) {
                return Err(self.fail(self.place(), "after a value, 'not' goes with 'in': type not in (0, 1)"));
            }
        }
        if self.take("in") {
            let value = Box::new(self.number(left)?);
            let list = self.list("after 'in': type in (0, 1)")?;
            return self.node(Kind::In { value, list, is_negated }, start);
        }
        let mut found: Option<(Node, Relation)> = None;
        while let Some(relation) = self.relation() {
            let sign = self.place();
            if let Some((_, before)) = found
                && !chains(before, relation)
            {
                return Err(
                    self.fail(sign, "comparisons chain in one direction only: join them by and, as in a < b and b > c")
                );
            }
            self.advance();
            let right = self.sum()?;
            let right_copy = right.clone();
            let link = Kind::Compare(relation, Box::new([self.number(left)?, self.number(right)?]));
            let link = self.node(link, start)?;
            let joined = match found {
                Some((chain, _)) => self.node(Kind::And(Box::new([chain, link])), start)?,
                None => link,
            };
            found = Some((joined, relation));
            left = right_copy;
        }
        Ok(found.map_or(left, |(node, _)| node))
    }

    /// `( … , … )`
    fn list(&mut self, why: &str) -> Result<Vec<Node>, ExpressionError> {
        self.expect("(", why)?;
        if matches!(self.peek(), Token::Symbol(")")) {
            return Err(self.fail(self.place(), "the list is empty"));
        }
        let mut nodes = Vec::new();
        loop {
            let node = self.any()?;
            nodes.push(self.number(node)?);
            if !self.take(",") {
                break;
            }
        }
        self.expect(")", "at the end of the list")?;
        Ok(nodes)
    }

    fn sum(&mut self) -> Parsed {
        let start = self.place().start;
        let mut left = self.product()?;
        loop {
            let operation = match self.peek() {
                Token::Symbol("+") => Arithmetic::Add,
                Token::Symbol("-") => Arithmetic::Subtract,
                _ => return Ok(left),
            };
            self.advance();
            let right = self.product()?;
            left = self.arithmetic(operation, left, right, start)?;
        }
    }

    fn product(&mut self) -> Parsed {
        let start = self.place().start;
        let mut left = self.prefixed()?;
        loop {
            let operation = match self.peek() {
                Token::Symbol("*") => Arithmetic::Multiply,
                Token::Symbol("/") => Arithmetic::Divide,
                Token::Symbol("%") => Arithmetic::Remainder,
                _ => return Ok(left),
            };
            self.advance();
            let right = self.prefixed()?;
            left = self.arithmetic(operation, left, right, start)?;
        }
    }

    fn arithmetic(&mut self, operation: Arithmetic, left: Node, right: Node, start: usize) -> Parsed {
        self.node(Kind::Arithmetic(operation, Box::new([self.number(left)?, self.number(right)?])), start)
    }

    /// `-a`, `+a`, `!(…)`. A loop, as `!!!!…` shall not take the stack.
    fn prefixed(&mut self) -> Parsed {
        let mut prefixes = Vec::new();
        while let Token::Symbol(symbol @ ("-" | "+" | "!")) = *self.peek() {
            prefixes.push((symbol, self.place().start));
            self.advance();
        }
        let mut inner = self.primary()?;
        for (symbol, start) in prefixes.into_iter().rev() {
            inner = match (symbol, &inner.kind) {
                ("!", _) if !inner.is_test() => {
                    return Err(self.fail(start..inner.place.end, "! wants a condition in parentheses: !(type == 0)"));
                }
                ("!", _) => self.node(Kind::Not(Box::new(inner)), start)?,
                ("+", _) => self.number(inner)?,
                // Literals stay whole: -1 is compared exactly.
                (_, Kind::Whole(whole)) => self.node(Kind::Whole(-whole), start)?,
                _ => {
                    let inner = self.number(inner)?;
                    self.node(Kind::Negate(Box::new(inner)), start)?
                }
            };
        }
        Ok(inner)
    }

    fn primary(&mut self) -> Parsed {
        let place = self.place();
        match self.peek().clone() {
            Token::Whole(value) => {
                self.advance();
                self.node(Kind::Whole(value), place.start)
            }
            Token::Real(value) => {
                self.advance();
                self.node(Kind::Real(value), place.start)
            }
            Token::Name { text, is_quoted } => {
                self.advance();
                if !is_quoted && matches!(self.peek(), Token::Symbol("(")) {
                    return self.call(&text, place);
                }
                let component = self.component()?;
                self.node(Kind::Name(Name { text, is_quoted, component }), place.start)
            }
            Token::Symbol("(") => {
                self.advance();
                let inner = self.any()?;
                if matches!(self.peek(), Token::Symbol(",")) {
                    return Err(self.fail(self.place(), "a list goes with 'in': type in (0, 1)"));
                }
                if !matches!(self.peek(), Token::End | Token::Symbol(")")) {
                    return Err(self.unexpected());
                }
                self.expect(")", &format!("for the ( at character {}", 1 + self.text[..place.start].chars().count()))?;
                Ok(inner)
            }
            _ => Err(self.unexpected()),
        }
    }

    fn component(&mut self) -> Result<Option<usize>, ExpressionError> {
        if self.take(".") {
            let place = self.place();
            let number = match self.peek() {
                Token::Name { text, .. } => match text.as_str() {
                    "x" | "r" => Some(0),
                    "y" | "g" => Some(1),
                    "z" | "b" => Some(2),
                    "w" | "a" => Some(3),
                    _ => None,
                },
                _ => None,
            };
            self.advance();
            let what =
                "a component is .x .y .z .w (or .r .g .b .a), or a number as in [0]; a name with a dot is quoted";
            return number.map(Some).ok_or_else(|| self.fail(place, what));
        }
        if self.take("[") {
            let place = self.place();
            let number = match self.peek() {
                Token::Whole(number) => usize::try_from(*number).ok(),
                _ => None,
            };
            self.advance();
            let Some(number) = number else { return Err(self.fail(place, "a component is a whole number from 0")) };
            self.expect("]", "after the number of a component")?;
            return Ok(Some(number));
        }
        Ok(None)
    }

    fn call(&mut self, name: &str, place: Range<usize>) -> Parsed {
        let (function, counts, example) = match name {
            "abs" => (Function::Abs, 1..=1, "abs(velocity.y)"),
            "min" => (Function::Min, 2..=usize::MAX, "min(x, y)"),
            "max" => (Function::Max, 2..=usize::MAX, "max(x, y)"),
            "length" => (Function::Length, 1..=1, "length(velocity)"),
            _ => {
                return Err(self.fail(place, format!("there is no function '{name}': there are abs, min, max, length")));
            }
        };
        let arguments = self.list("after the function's name")?;
        let node = self.node(Kind::Call(function, arguments), place.start)?;
        if let Kind::Call(_, arguments) = &node.kind {
            if !counts.contains(&arguments.len()) {
                let wanted = if *counts.end() == 1 { "one value" } else { "two values or more" };
                return Err(self.fail(node.place, format!("{name} takes {wanted}: {example}")));
            }
            let is_vector = |n: &Node| matches!(&n.kind, Kind::Name(name) if name.component.is_none());
            if function == Function::Length && !arguments.iter().all(is_vector) {
                return Err(self.fail(node.place, "length takes a vector attribute by its name: length(velocity)"));
            }
        }
        Ok(node)
    }
}

/// Whether `a R b S c` reads as one statement.
fn chains(first: Relation, second: Relation) -> bool {
    use Relation::{Equal, Greater, GreaterOrEqual, Less, LessOrEqual};
    let is_one = |all: &[Relation]| all.contains(&first) && all.contains(&second);
    is_one(&[Less, LessOrEqual]) || is_one(&[Greater, GreaterOrEqual]) || is_one(&[Equal])
}
