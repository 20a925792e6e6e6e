//! Rhai's own functions that experiments are mostly written with; <https://rhai.rs/book> has all.

use super::{Known, Parameter, arg, call, function, method, pattern};

const ARRAY: Parameter = arg("array", "Array");
const MAP: Parameter = arg("map", "Map");
const TEXT: Parameter = arg("text", "String");
const VALUE: Parameter = arg("value", "?");
const MAPPER: Parameter = pattern("mapper", "FnPtr", "|x| y");
const FILTER: Parameter = pattern("filter", "FnPtr", "|x| bool");

pub(super) const STANDARD: &[Known] = &[
    function(
        "print",
        &[call(&[VALUE], "()", "print(\"40 bins\")")],
        "shows a line, at the top level and in `runner check`",
    ),
    function("debug", &[call(&[VALUE], "()", "debug([1, 2])")], "the same, with quotes and types"),
    function("type_of", &[call(&[VALUE], "String", "type_of(1.0)")], "the name of a value's type"),
    function(
        "range",
        &[
            call(&[arg("from", "int"), arg("to", "int")], "Range", "range(0, 5)"),
            call(
                &[arg("from", "int"), arg("to", "int"), arg("step", "int")],
                "Range",
                "range(0, 100, 10)",
            ),
        ],
        "numbers to loop over, `to` excluded; range(0, 5) is 0..5",
    ),
    method(
        "len",
        &[call(&[arg("list", "Array | Map | String")], "int", "[1, 2].len()")],
        "how many there are; of a state, its fields",
    ),
    method("push", &[call(&[ARRAY, VALUE], "()", "[1].push(2)")], "appends a value"),
    method("pop", &[call(&[ARRAY], "?", "[1].pop()")], "removes the last value and returns it"),
    method(
        "insert",
        &[call(&[ARRAY, arg("index", "int"), VALUE], "()", "[1].insert(0, 2)")],
        "puts a value in",
    ),
    method(
        "remove",
        &[
            call(&[ARRAY, arg("index", "int")], "?", "[1].remove(0)"),
            call(&[MAP, arg("key", "String")], "?", "#{ a: 1 }.remove(\"a\")"),
        ],
        "takes a value out and returns it",
    ),
    method(
        "contains",
        &[call(&[arg("list", "Array | Map | String"), VALUE], "bool", "[1].contains(1)")],
        "whether a value is in it; of a map, a key",
    ),
    method("keys", &[call(&[MAP], "Array", "#{ a: 1 }.keys()")], "the keys, in alphabetical order"),
    method("values", &[call(&[MAP], "Array", "#{ a: 1 }.values()")], "the values, by their keys"),
    method(
        "map",
        &[call(&[ARRAY, MAPPER], "Array", "[1, 2].map(|x| 10 * x)")],
        "what becomes of each value",
    ),
    method(
        "filter",
        &[call(&[ARRAY, FILTER], "Array", "[1, 2].filter(|x| x > 1)")],
        "the values for which it is true",
    ),
    method(
        "reduce",
        &[call(
            &[ARRAY, pattern("step", "FnPtr", "|sum, x| sum"), arg("start", "?")],
            "?",
            "[1, 2].reduce(|sum, x| sum + x, 0)",
        )],
        "all values in one",
    ),
    method(
        "some",
        &[call(&[ARRAY, FILTER], "bool", "[1, 2].some(|x| x > 1)")],
        "whether it is true for any value",
    ),
    method(
        "all",
        &[call(&[ARRAY, FILTER], "bool", "[1, 2].all(|x| x > 0)")],
        "whether it is true for all values",
    ),
    method("reverse", &[call(&[ARRAY], "()", "[1, 2].reverse()")], "turns it round"),
    method("sort", &[call(&[ARRAY], "()", "[2, 1].sort()")], "sorts it"),
    method(
        "sort_desc",
        &[call(&[ARRAY], "()", "[1, 2].sort_desc()")],
        "sorts it, the largest first",
    ),
    method(
        "split",
        &[call(&[TEXT, arg("delimiter", "String")], "Array", "\"a,b\".split(\",\")")],
        "the parts of a text",
    ),
    function(
        "to_string",
        &[call(&[VALUE], "String", "to_string(40)")],
        "as text; also `40 bins: ${value}` between backticks",
    ),
    function("parse_int", &[call(&[TEXT], "int", "parse_int(\"40\")")], "the integer in a text"),
    function("parse_float", &[call(&[TEXT], "float", "parse_float(\"0.5\")")], "the float in one"),
];
