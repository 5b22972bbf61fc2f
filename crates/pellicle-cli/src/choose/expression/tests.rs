//! What the language means, and what it refuses.

use pellicle_io::{AttributeValues, ParticleAttribute, Particles, PositionData};

use super::Expression;

fn attribute(name: &str, components: usize, values: AttributeValues) -> ParticleAttribute {
    ParticleAttribute { name: name.into(), components, values }
}

/// Four particles on the x axis, at 0, 1, 2, 3.
fn particles() -> Particles {
    let big = 1i64 << 60;
    Particles {
        positions: PositionData::F32(vec![[0., 5., -1.], [1., 5., -2.], [2., 5., -3.], [3., 5., -4.]]),
        attributes: vec![
            attribute("density", 1, AttributeValues::F64(vec![1.0, f64::NAN, 3.0, 4.0])),
            attribute("type", 1, AttributeValues::I32(vec![0, 1, 1, -2])),
            attribute("id", 1, AttributeValues::I64(vec![big, big + 1, big + 2, i64::MAX])),
            attribute("velocity", 3, AttributeValues::F32(vec![3., 4., 0., 0., 0., 1., -2., 0., 0., 0., f32::NAN, 0.])),
            attribute("x", 1, AttributeValues::F32(vec![9., 8., 7., 6.])),
            attribute("größe in mm", 1, AttributeValues::F32(vec![0.5, 1.5, 2.5, 3.5])),
        ],
    }
}

fn kept(text: &str) -> Vec<usize> {
    let particles = particles();
    let expression = Expression::parse(text).unwrap_or_else(|e| panic!("{e}"));
    let bound = expression.bind(&particles).unwrap_or_else(|e| panic!("{e}"));
    let mut keep = vec![true; 4];
    bound.narrow(&mut keep);
    (0..4).filter(|&i| keep[i]).collect()
}

/// The message to a text that is refused, by the parser or by these particles.
fn refused(text: &str) -> String {
    match Expression::parse(text) {
        Err(error) => error.to_string(),
        Ok(expression) => match expression.bind(&particles()) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{text} was taken"),
        },
    }
}

#[test]
fn comparisons_keep_what_satisfies_them() {
    assert_eq!(kept("type==0"), [0]);
    assert_eq!(kept("type != 1"), [0, 3]);
    assert_eq!(kept("x < 2"), [0, 1]);
    assert_eq!(kept("x <= 2"), [0, 1, 2]);
    assert_eq!(kept("2 < x"), [3]);
    assert_eq!(kept("type >= 0.5"), [1, 2]);
    assert_eq!(kept("0.5 > type"), [0, 3]);
    assert_eq!(kept("0 < x < 3"), [1, 2]);
    assert_eq!(kept("3 >= x >= 1.5"), [2, 3]);
    assert_eq!(kept("type == 1 == 1.0"), [1, 2]);
}

#[test]
fn words_and_signs_join_with_the_usual_precedence() {
    assert_eq!(kept("x == 0 or x == 1 and type == 0"), [0], "and binds more than or");
    assert_eq!(kept("(x == 0 || x == 1) && type == 1"), [1]);
    assert_eq!(kept("not x == 1"), [0, 2, 3]);
    assert_eq!(kept("not not x == 1"), [1]);
    assert_eq!(kept("!(x == 1) && !(x == 2)"), [0, 3]);
    assert_eq!(kept("not x == 1 and type == 1"), [2]);
    assert_eq!(kept("x == 0 AND type == 0 OR x == 3"), [0, 3]);
}

#[test]
fn arithmetic_binds_as_on_paper() {
    assert_eq!(kept("x + 2 * 3 == 7"), [1]);
    assert_eq!(kept("(x + 2) * 3 == 12"), [2]);
    assert_eq!(kept("10 - x - 2 == 7"), [1], "from left to right");
    assert_eq!(kept("-x + 1 == -1"), [2]);
    assert_eq!(kept("8 / 2 / 2 == x"), [2]);
    assert_eq!(kept("index % 2 == 1"), [1, 3]);
    assert_eq!(kept("- -x == 3"), [3]);
    assert_eq!(kept(".5e1 - 4. == +x"), [1]);
}

#[test]
fn functions_components_and_lists() {
    assert_eq!(kept("length(velocity) == 5"), [0]);
    assert_eq!(kept("length(position) > 6"), [2, 3]);
    assert_eq!(kept("abs(velocity.x) >= 2"), [0, 2]);
    assert_eq!(kept("velocity[1] == 4 or velocity.b == 1"), [0, 1]);
    assert_eq!(kept("min(x, 1, 2) == max(-1, type)"), [0, 1, 2]);
    assert_eq!(kept("position.x == 1 or position[2] == z and z < -3"), [1, 3]);
    assert_eq!(kept("type in (0, -2)"), [0, 3]);
    assert_eq!(kept("type not in (0, -2)"), [1, 2]);
    assert_eq!(kept("x in (1, type + 1)"), [1, 2]);
    assert_eq!(kept("type in (0.0, x)"), [0, 1]);
    assert_eq!(kept("y == 5 and index in (3)"), [3]);
}

#[test]
fn whole_numbers_are_compared_with_all_their_bits() {
    assert_eq!(kept("id == 1152921504606846977"), [1]);
    assert_eq!(kept("id > 1152921504606846977"), [2, 3]);
    assert_eq!(kept("id in (1152921504606846978, 5)"), [2]);
    assert_eq!(kept("id == 1152921504606846976.0"), [0], "the real number is 2^60 exactly");
    assert_eq!(kept("id < 1152921504606846976.5e0"), [] as [usize; 0]);
    assert_eq!(kept("id < 9223372036854775808.0"), [0, 1, 2, 3], "the largest integer is below 2^63");
    assert_eq!(kept("id >= 9223372036854775807"), [3]);
    assert_eq!(kept("-9223372036854775807 < type"), [0, 1, 2, 3]);
}

#[test]
fn nan_satisfies_no_comparison() {
    for text in ["density == density", "density < 9 or density >= 9", "density != 1e9", "density not in (7)"] {
        assert_eq!(kept(text), [0, 2, 3], "{text}");
    }
    assert_eq!(kept("min(density, 0) == 0"), [0, 2, 3]);
    assert_eq!(kept("max(0, density) >= 0"), [0, 2, 3]);
    assert_eq!(kept("length(velocity) >= 0"), [0, 1, 2]);
    assert_eq!(kept("type != density"), [0, 2, 3]);
    assert_eq!(kept("not density < 9"), [1]);
    assert_eq!(kept("0 / 0 != 0"), [] as [usize; 0]);
}

#[test]
fn quotes_and_other_letters_name_attributes() {
    assert_eq!(kept("\"größe in mm\" > 2"), [2, 3]);
    assert_eq!(kept("'x' == 7"), [2], "the attribute, not the position");
    assert_eq!(kept("x == 2"), [2]);
    // The name in the file leads to the one in memory.
    assert_eq!(kept("v.x == 3"), [0]);
    assert_eq!(kept("Velocity.z == 1"), [1]);
}

#[test]
fn names_are_what_a_reader_is_asked_for() {
    let expression =
        Expression::parse("x > 0 and velocity.x < \"x\" or type in (id, index, 3) and type > position.y").unwrap();
    assert_eq!(expression.names(), ["velocity", "x", "type", "id"]);
    assert_eq!(Expression::parse("length(position) < 1").unwrap().names(), [] as [&str; 0]);
}

#[test]
fn mistakes_are_shown_at_their_place_with_the_remedy() {
    let shown = refused("type = 0");
    assert_eq!(shown, "a single = compares nothing: equality is ==\n  type = 0\n       ^");
    let shown = refused("x > 0 and größe != 1");
    assert!(shown.ends_with("\n  x > 0 and größe != 1\n            ^^^^^"), "{shown}");
    for (text, hint) in [
        ("", "is empty"),
        ("  ", "is empty"),
        ("type", "type != 0"),
        ("x + 1", "compare it, as in x + 1 != 0"),
        ("type == 0 & x > 1", "&&"),
        ("type == 0 | x > 1", "||"),
        ("type =< 0", "<="),
        ("type => 0", ">="),
        ("type <> 0", "!="),
        ("x ** 2 > 1", "x*x"),
        ("x^2 > 1", "x*x"),
        ("type == 'fluid'", "quotes enclose names"),
        ("type == \"fluid", "closing"),
        ("'' == 1", "no name between"),
        ("!type == 0", "!("),
        ("not type", "compare it"),
        ("x < 1 and 2", "2 != 0"),
        ("1 < x > 2", "one direction"),
        ("x == (y == z)", "a number is wanted"),
        ("(x < 1) + 1 > 0", "a number is wanted"),
        ("(x < 1) < 2", "a number is wanted"),
        ("x <", "ends too early"),
        ("x < 1 y", "an operator is missing"),
        ("(x < 1", "for the ( at character 1"),
        ("x < 1)", "closes nothing"),
        ("type in 0, 1", "type in (0, 1)"),
        ("type in {0, 1}", "parentheses"),
        ("type in ()", "the list is empty"),
        ("(1, 2) == type", "a list goes with 'in'"),
        ("type not 3", "type not in"),
        ("velocity > 1", "velocity.x"),
        ("abs(velocity) > 1", "length(velocity)"),
        ("length(density) > 1", "abs(density)"),
        ("length(velocity.x) > 1", "by its name"),
        ("length(x) > 1", "one number"),
        ("density.x > 1", "write density alone"),
        ("index.x > 1", "no components"),
        ("x.y > 1", "no components"),
        ("velocity[3] > 1", "the last one is velocity[2]"),
        ("velocity[-1] > 1", "whole number from 0"),
        ("velocity.speed > 1", "a component is"),
        ("velocity. > 1", "a component is"),
        ("velocty.x > 1", "did you mean velocity?"),
        ("Density > 1", "did you mean density?"),
        ("pressure > 1", "there are: density, type, id, velocity"),
        ("sqrt(x) > 1", "abs, min, max, length"),
        ("min(x) > 1", "two values"),
        ("abs(x, y) > 1", "one value"),
        ("x > 10m", "runs into a name"),
        ("x > 1e999", "too large"),
        ("$type == 0", "density, not $density"),
        ("x > 1; y", "';' means nothing"),
    ] {
        let message = refused(text);
        assert!(message.contains(hint) && message.contains('^'), "{text}: {message}");
    }
}

#[test]
fn no_text_exhausts_the_stack() {
    for text in [
        "(".repeat(100_000),
        format!("{}x < 1", "not ".repeat(100_000)),
        format!("{}(x < 1)", "!".repeat(100_000)),
        format!("{}x < 1", "-".repeat(100_000)),
        format!("x{} < 1", " + x".repeat(100_000)),
        "min(".repeat(100_000),
        format!("x {}", "< 1 ".repeat(100_000)),
    ] {
        let message = Expression::parse(&text).expect_err(&text[..20]).to_string();
        assert!(message.contains("levels") && message.len() < 600, "{message}");
    }
    let deep = format!("{}x == 1{}", "(".repeat(150), ")".repeat(150));
    assert_eq!(kept(&deep), [1]);
    let long: Vec<String> = (0..100_000).map(|i| (2 * i).to_string()).collect();
    assert_eq!(kept(&format!("index in ({})", long.join(","))), [0, 2]);
}

#[test]
fn blocks_make_no_difference() {
    let n = 10_007;
    let particles = Particles {
        positions: PositionData::F64((0..n).map(|i| [f64::from(i), 0.0, 0.0]).collect()),
        attributes: vec![attribute("v3", 3, AttributeValues::I32((0..3 * n).collect()))],
    };
    let expression = Expression::parse("index % 3 == 0 and v3[2] > 600 or x in (1, 5000) and not index < 2").unwrap();
    let mut keep: Vec<bool> = (0..n).map(|i| i != 9000).collect();
    expression.bind(&particles).unwrap().narrow(&mut keep);
    for i in 0..n {
        let want = i % 3 == 0 && 3 * i + 2 > 600 || [1, 5000].contains(&i) && i >= 2;
        assert_eq!(keep[i as usize], want && i != 9000, "{i}");
    }
}
