//! Integration tests: one binary, one module a subject.

mod blackjack;
mod cli;
mod crash;
mod env;
mod floors;
mod frozen_lake;
mod golden;
mod language;
mod numbers;
mod parity;
mod placing;
mod play;
mod readme;
mod refusals;
mod render;
mod scripts;
mod setting;
mod shaping;
mod show;
mod support;
mod theory;
mod toy_text;
mod unreadable;
mod variants;
mod wiewiora;
