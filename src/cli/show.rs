//! `runner show RESULTS`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use clap::Args as ClapArgs;
use serde_json::json;

use super::output::{note, out, palette};
use super::{Failure, Outcome};
use crate::experiment::{Unit, write_atomically};
use crate::report::claims::judge;
use crate::report::closing::closing_table;
use crate::report::frame::Request;
use crate::report::heat_map::render;
use crate::report::picture::{Picture, Quantity, Tables, pictures};
use crate::report::picture_svg::picture_svg;
use crate::report::results::variant_json;
use crate::report::stored::Stored;
use crate::script::Host;

#[derive(Debug, ClapArgs)]
#[expect(clippy::struct_excessive_bools, reason = "flags of a command line")]
pub(super) struct Args {
    /// The results folder
    results: PathBuf,
    /// Pictures of this variant only [default: of each]
    #[arg(long, value_name = "NAME")]
    variant: Option<String>,
    /// The training seed whose table is pictured, or `all`: mean values, and the action that most
    /// seeds take [default: each variant's first]
    #[arg(long, value_name = "N|all")]
    seed: Option<String>,
    /// Picture the value [default: value, greedy action and, if there is one, the potential]
    #[arg(long)]
    value: bool,
    /// Picture the greedy action
    #[arg(long)]
    policy: bool,
    /// Picture the potential
    #[arg(long)]
    potential: bool,
    /// The fields across and along the page [default: the two with the most values]
    #[arg(long, value_name = "X,Y")]
    fields: Option<String>,
    /// Where other fields stand, for example `theta=0.1,x=0` [default: in the middle]
    #[arg(long, value_name = "F=V,..", value_delimiter = ',', allow_hyphen_values = true)]
    at: Vec<String>,
    /// Write each picture as an SVG file into this folder, made if need be
    #[arg(long, value_name = "DIR", conflicts_with = "json")]
    svg: Option<PathBuf>,
    /// Print the statistics and the numbers of every picture as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, Failure> {
    let request = request(args)?;
    let seed = match args.seed.as_deref() {
        None => Seeds::First,
        Some("all") => Seeds::All,
        Some(text) => Seeds::One(text.parse().map_err(|_| {
            Failure::Message(
                format!("--seed: `{text}` is neither a training seed nor `all`"),
                Some("give a whole number, for example --seed 3".into()),
            )
        })?),
    };
    let stored = Stored::open(&args.results)?;
    let only = args.variant.as_deref().map(|name| stored.variant(Some(name))).transpose()?;
    let host = Host::open(&stored.plan)?;
    let (present, incomplete) = stored.present()?;
    let (plan, findings) = stored.findings(&host, &present)?;
    if !args.json {
        if !plan.variants.is_empty() {
            out(&closing_table(&plan, &findings).render())?;
        }
        if incomplete.is_none() {
            for (text, holds) in judge(&plan, &host, &findings)? {
                out(&format!("{} {text}\n", if holds { "ok    " } else { "FAILED" }))?;
            }
        }
    }
    if let Some(incomplete) = &incomplete {
        note(incomplete);
    }
    let mut all = Vec::new();
    for index in 0..stored.plan.variants.len() {
        if only.is_some_and(|only| only != index) {
            continue;
        }
        let there = present.iter().any(|u| u.variant == index);
        let learns = match tables(&stored, index, seed, &present) {
            Ok(tables) => Some(tables),
            // Asked for by name or not, a variant that is there has to say why it is not shown.
            Err(failure) if only.is_some() || (there && seed != Seeds::First) => {
                return Err(failure);
            }
            Err(_) if !there => None,
            Err(Failure::Message(message, _)) => {
                note(&format!("note: {message}"));
                None
            }
            Err(failure) => return Err(failure),
        };
        if let Some(tables) = learns {
            let variant = &stored.plan.variants[index];
            all.extend(pictures(&host, variant, &tables, &request, &quantities(args))?);
        }
    }
    if args.json {
        let variants = findings.summaries.iter().zip(&findings.audits);
        let text = serde_json::to_string_pretty(&json!({
            "study": stored.plan.name,
            "complete": incomplete.is_none(),
            "variants": variants.map(|(s, a)| variant_json(s, a)).collect::<Vec<_>>(),
            "pictures": all.iter().map(Picture::json).collect::<Vec<_>>(),
        }))
        .expect("plain data");
        out(&format!("{text}\n"))?;
    } else if let Some(folder) = &args.svg {
        write(folder, &all)?;
    } else {
        for picture in &all {
            out(&format!("\n{}", render(picture, palette())))?;
        }
    }
    Ok(Outcome::Fine)
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Seeds {
    First,
    One(u64),
    All,
}

/// The tables of a variant's seeds that are asked for; of all those that are there.
fn tables(
    stored: &Stored,
    index: usize,
    seeds: Seeds,
    present: &[Unit],
) -> Result<Tables, Failure> {
    let own = || present.iter().filter(|u| u.variant == index);
    if seeds != Seeds::All || own().next().is_none() {
        let seed = if let Seeds::One(seed) = seeds { Some(seed) } else { None };
        let unit = stored.unit(index, seed)?;
        let learned = vec![stored.learned(unit)?];
        return Ok(Tables { learned, seeds: vec![unit.seed] });
    }
    let learned = own().map(|unit| stored.learned(unit)).collect::<Result<_, _>>()?;
    Ok(Tables { learned, seeds: own().map(|u| u.seed).collect() })
}

fn quantities(args: &Args) -> Vec<Quantity> {
    let asked = [
        (args.value, Quantity::Value),
        (args.policy, Quantity::Policy),
        (args.potential, Quantity::Potential),
    ];
    let none = !asked.iter().any(|(asked, _)| *asked);
    asked.into_iter().filter(|(asked, _)| none || *asked).map(|(_, q)| q).collect()
}

fn request(args: &Args) -> Result<Request, Failure> {
    let bad = |message: String, hint: &str| Failure::Message(message, Some(hint.into()));
    let fields = match &args.fields {
        None => None,
        Some(text) => match text.split(',').map(str::trim).collect::<Vec<_>>()[..] {
            [x, y] if !x.is_empty() && !y.is_empty() => Some((x.to_string(), y.to_string())),
            _ => {
                let message = format!("--fields: two names of fields, not `{text}`");
                return Err(bad(message, "write, for example, --fields theta,theta_dot"));
            }
        },
    };
    let at = args.at.iter().map(|text| {
        let pair = text.split_once('=').map(|(name, value)| (name.trim(), value.trim().parse()));
        match pair {
            Some((name, Ok(value))) if f64::is_finite(value) => Ok((name.to_string(), value)),
            _ => Err(bad(
                format!("--at: a field and a number, not `{text}`"),
                "write, for example, --at theta=0.1,x=0",
            )),
        }
    });
    Ok(Request { fields, at: at.collect::<Result<_, _>>()? })
}

/// Writes each picture into `folder` and names the files.
fn write(folder: &Path, pictures: &[Picture]) -> Result<(), Failure> {
    std::fs::create_dir_all(folder).map_err(|e| {
        Failure::Message(format!("{}: cannot be made: {e}", folder.display()), None)
    })?;
    let mut used = std::collections::BTreeSet::new();
    for picture in pictures {
        let stem = file_stem(picture);
        let mut name = stem.clone();
        // Variants whose names differ in special characters only.
        for n in 2.. {
            if used.insert(name.clone()) {
                break;
            }
            name = format!("{stem}-{n}");
        }
        let path = folder.join(format!("{name}.svg"));
        write_atomically(&path, picture_svg(picture).as_bytes())?;
        out(&format!("{}\n", path.display()))?;
    }
    Ok(())
}

/// `plain-value`, `plain-value-ace=1`: letters that every file system takes.
fn file_stem(picture: &Picture) -> String {
    let mut name = format!("{}-{}", picture.variant, picture.quantity.as_str());
    for (field, value) in &picture.at {
        let _ = write!(name, "-{field}={value}");
    }
    let plain = |c: char| if c.is_alphanumeric() || "-_=.".contains(c) { c } else { '_' };
    name.chars().map(plain).collect::<String>().trim_start_matches('.').to_string()
}
