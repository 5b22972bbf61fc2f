//! Which particles to keep, as a text: `type == 0 and length(velocity) < 3`.
//!
//! ```text
//! text ─ lexer ─► tokens ─ parser ─► tree ─ bind, to the attributes of one file ─► Bound ─ eval ─► one bool a particle
//! ```
//!
//! The language, from what binds least to what binds most:
//! - `or` `||`, then `and` `&&`, then `not`;
//! - comparisons `== != < <= > >=`, also chained in one direction: `0 < x <= 1`; `type in (0, 1)`, `type not in (0, 1)`;
//! - `+ -`, then `* / %` (the remainder has the sign of what is divided), then the prefixes `-`, `+` and `!`;
//! - numbers; `abs(a)`, `min(a, b, …)`, `max(a, b, …)`, `length(vector)`; parentheses.
//!
//! Names are attributes: `density`, and the components of vectors, `velocity.x` (also `y z w`, and `r g b a`) or
//! `velocity[0]`. `x y z`, also as `position.x`, are the position, and `index` is the particle's number in the file, from 0.
//! Quotes take any name, and always an attribute's: `"largest density" > 2`, `"x"`.
//!
//! Numbers are computed in double precision; whole numbers (attributes of integers, `index`, literals) are compared exactly,
//! all 64 bits of them. NaN satisfies no comparison, `!=` and `not in` neither; `not` of a comparison is true where the
//! comparison is not. A comparison is no number, and a number no comparison: what is mixed up is refused with its place.

mod bind;
mod error;
mod eval;
mod lexer;
mod parser;
#[cfg(test)]
mod tests;

pub use bind::Bound;
pub use error::ExpressionError;

use pellicle_io::Particles;

use parser::{Kind, Node};

/// An expression that can be asked of any file's particles.
#[derive(Debug, Clone)]
pub struct Expression {
    text: String,
    root: Node,
}

impl Expression {
    /// Reads an expression. Its depth is bounded, so that no text exhausts the stack.
    ///
    /// # Errors
    /// The message shows the text with a mark under the place, and what to write there.
    pub fn parse(text: &str) -> Result<Self, ExpressionError> {
        let root = parser::parse(text)?;
        Ok(Self { text: text.to_owned(), root })
    }

    /// The text as given.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The attributes that the expression looks at, each once, in the order of their first appearance: what a reader is to
    /// be asked for ([`ReadOptions::also`](pellicle_io::ReadOptions::also)).
    pub fn names(&self) -> Vec<&str> {
        let mut names = Vec::new();
        self.root.visit(&mut |node| {
            if let Kind::Name(name) = &node.kind
                && name.is_attribute()
                && !names.contains(&name.text.as_str())
            {
                names.push(name.text.as_str());
            }
        });
        names
    }

    /// Ties the names to the attributes of these particles.
    ///
    /// # Errors
    /// An attribute that is not there (with those that are, and the one that was perhaps meant), or a vector in a number's
    /// place and the other way round.
    pub fn bind<'a>(&self, particles: &'a Particles) -> Result<Bound<'a>, ExpressionError> {
        bind::bind(&self.text, &self.root, particles)
    }
}

impl std::str::FromStr for Expression {
    type Err = ExpressionError;

    fn from_str(text: &str) -> Result<Self, ExpressionError> {
        Self::parse(text)
    }
}
