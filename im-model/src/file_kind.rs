//! What a file is, by what stands in it: for a message about one that was given in the place of another.

use toml::de::DeTable;

/// A kind of file that the programs read as text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileKind {
    /// A motor: `[machine]` with its parameters.
    Motor,
    /// What happens in a simulation: `[scenario]`.
    Scenario,
    /// What the columns of a recording mean: `[voltage]`, `[current]`.
    Mapping,
    /// What the columns of a table of steady states mean: `[table]`.
    TableMapping,
    /// Gains with their proof: `schema` and `[design]`.
    Certificate,
    /// What a design shall hold for; read by its keys alone, so that no other kind is taken for it.
    Region,
    /// Rows of numbers: no other kind is taken for it either.
    Rows,
    /// A case of a claim: `claim` and its values.
    Claim,
    /// What a diagnosis found, in JSON.
    Diagnosis,
    /// A page to look at in a browser.
    Page,
}

impl FileKind {
    /// The kind of a file with this text, where its first level says it.
    pub fn of(text: &str) -> Option<Self> {
        let start = text.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
        if start.starts_with('{') {
            return start.contains("\"verdict\"").then_some(Self::Diagnosis);
        }
        if start.get(..9).is_some_and(|s| s.eq_ignore_ascii_case("<!doctype")) {
            return Some(Self::Page);
        }
        let root = DeTable::parse(text).ok()?;
        let has = |key: &str| root.get_ref().contains_key(key);
        // A scenario has a current and a load as well, a case of a claim a machine.
        let signs = [
            (has("scenario"), Self::Scenario),
            (has("claim"), Self::Claim),
            (has("machine"), Self::Motor),
            (has("table"), Self::TableMapping),
            (has("schema") && has("design"), Self::Certificate),
            (has("voltage") && has("current"), Self::Mapping),
        ];
        signs.into_iter().find_map(|(is, kind)| is.then_some(kind))
    }

    /// In words, with the option that takes it.
    fn words(self) -> &'static str {
        match self {
            Self::Motor => "a motor file ([machine]); give it as --motor",
            Self::Scenario => "a scenario of a simulation ([scenario]); give it as --scenario to im simulate",
            Self::Mapping => {
                "what the columns of a recording mean ([voltage], [current]); it goes where the recording goes, or to --mapping"
            }
            Self::TableMapping => "what the columns of a table mean ([table]); give the table itself, with this file beside it",
            Self::Certificate => {
                "a file of gains with their proof ([design]); give it as --gains to im observe, or to im design check"
            }
            Self::Region => "a region for im design; give it as --region",
            Self::Rows => "rows of numbers; give a recording as --data or --train, a table of steady states as --table",
            Self::Claim => "a case of a claim; give it as --replay to im verify",
            Self::Diagnosis => "the diagnosis.json of im diagnose; give it as --diagnosis to im next-test, or to im report",
            Self::Page => "a page for a browser; give the file that it was made from",
        }
    }

    /// What is said about a text of another kind that stands in the place of a file of this one.
    pub fn mistaken(self, text: &str) -> Option<String> {
        let found = Self::of(text).filter(|kind| *kind != self)?;
        let expected = match self {
            Self::Motor => "a motor file",
            Self::Scenario => "a scenario",
            Self::Mapping => "a recording, or what its columns mean,",
            Self::TableMapping => "what the columns of a table mean",
            Self::Certificate => "a file of gains with their proof",
            Self::Region => "a region file of im design",
            Self::Rows => "a table of steady states",
            Self::Claim => "a case of a claim",
            Self::Diagnosis => "a diagnosis.json",
            Self::Page => "a page",
        };
        Some(format!("{expected} is expected here, and this is {}", found.words()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_known_by_what_stands_in_it() {
        let read = |path: &str| std::fs::read_to_string(format!("{}/../{path}", env!("CARGO_MANIFEST_DIR"))).unwrap();
        assert_eq!(FileKind::of(&read("examples/motor.toml")), Some(FileKind::Motor));
        assert_eq!(FileKind::of(&read("examples/motor_kwon.toml")), Some(FileKind::Motor));
        assert_eq!(FileKind::of(&read("examples/scenario_drive.toml")), Some(FileKind::Scenario));
        let claim = "im-verify/tests/counterexamples/03-kubota_v_falls_for_any_error.toml";
        assert_eq!(FileKind::of(&read(claim)), Some(FileKind::Claim));
        for (text, kind) in [
            ("start = \"auto\"\n[voltage]\na = \"u\"\n[current]\na = \"i\"", Some(FileKind::Mapping)),
            ("[table]\nvoltage = \"U\"", Some(FileKind::TableMapping)),
            ("schema = 2\n[design]\nname = \"x\"", Some(FileKind::Certificate)),
            ("\u{feff}\n{\"schema\": 1, \"verdict\": \"adequate\"}", Some(FileKind::Diagnosis)),
            ("<!DOCTYPE html>\n<html>", Some(FileKind::Page)),
            ("t_s,u_alpha_V\n0,1", None),
            ("{}", None),
            ("", None),
        ] {
            assert_eq!(FileKind::of(text), kind, "{text}");
        }
    }

    #[test]
    fn only_another_kind_is_a_mistake() {
        let motor = "[machine]\npole_pairs = 2";
        assert_eq!(FileKind::Motor.mistaken(motor), None);
        assert_eq!(
            FileKind::Mapping.mistaken(motor).as_deref(),
            Some(
                "a recording, or what its columns mean, is expected here, and this is a motor file ([machine]); give it as --motor"
            )
        );
    }
}
