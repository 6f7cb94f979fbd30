//! LaTeX to MathML, which browsers set without scripts or fonts of ours.

use pulldown_latex::config::{DisplayMode, RenderConfig};
use pulldown_latex::{Parser, Storage, push_mathml};

/// An equation as MathML; refuses LaTeX that is not understood.
pub fn mathml(latex: &str, block: bool) -> Result<String, String> {
    let storage = Storage::new();
    for event in Parser::new(latex, &storage) {
        event.map_err(|e| format!("equation not understood: {}", e.to_string().lines().next().unwrap_or_default()))?;
    }
    let display_mode = if block { DisplayMode::Block } else { DisplayMode::Inline };
    let config = RenderConfig { display_mode, ..RenderConfig::default() };
    let mut out = String::new();
    let storage = Storage::new();
    push_mathml(&mut out, Parser::new(latex, &storage), config).map_err(|e| format!("equation not written: {e}"))?;
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::mathml;

    #[test]
    fn equations_become_mathml_and_errors_are_reported() {
        let out = mathml(r"\frac{d\psi_s}{dt} = u_s - R_s i_s", true).unwrap();
        assert!(out.starts_with("<math") && out.contains("mfrac"), "{out}");
        assert!(mathml(r"\frac{1}", false).is_err());
        assert!(mathml(r"\nosuchcommand x", false).is_err());
    }
}
