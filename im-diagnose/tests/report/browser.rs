//! The pages in a real browser: they zoom, tell values, overflow nowhere, and ask for nothing from the network.

use std::path::{Path, PathBuf};
use std::process::Command;

use im_diagnose::report::{Comparison, Meta, SideBySide, Story, compare_html, html, side_by_side};
use serde_json::Value;

use crate::cases;
use crate::words::meta;

/// What the page does by itself when it is tested; the answer goes to the page around it.
const DRIVER: &str = r##"<script>
addEventListener("load", () => setTimeout(() => {
  const found = { errors: window.failures, width: innerWidth, page: document.documentElement.scrollWidth };
  const box = document.getElementById("zoom"), span = document.getElementById("span");
  if (box) {
    const at = (button) => { document.querySelector(button).click(); return span.textContent; };
    found.worst = span.textContent;
    found.tenth = at("[data-zoom=tenth]");
    found.all = at("[data-zoom=all]");
    found.other = at("[data-run='1']");
    found.inner = at("[data-zoom=in]");
    found.right = at("[data-zoom=right]");
    found.again = at("[data-zoom=worst]");
    const r = box.getBoundingClientRect();
    const point = (type, x) => box.dispatchEvent(new PointerEvent(type, { clientX: r.left + x, clientY: r.top + 60, pointerId: 1, bubbles: true }));
    box.setPointerCapture = () => {};
    point("pointermove", 0.5 * r.width);
    const tip = document.getElementById("read"), at_pointer = tip.getBoundingClientRect();
    found.read = [...tip.querySelectorAll("tr")].map((row) => [...row.children].map((c) => c.textContent).join(" | ")).join("\n");
    found.tip = [at_pointer.left, innerWidth - at_pointer.right, Math.abs(at_pointer.top - r.top - 60)];
    point("pointerdown", 0.3 * r.width);
    point("pointermove", 0.6 * r.width);
    point("pointerup", 0.6 * r.width);
    found.dragged = span.textContent;
    found.lines = box.querySelectorAll("path.line").length;
    found.broken = /NaN|Infinity|undefined/.test(box.innerHTML);
  }
  found.after = document.documentElement.scrollWidth;
  document.getElementById("theme").click();
  found.theme = document.documentElement.dataset.theme;
  // Text of charts that sticks out of its picture.
  found.cut = [...document.querySelectorAll("svg.chart text")].filter((t) => {
    const a = t.getBoundingClientRect(), b = t.closest("svg.chart").getBoundingClientRect();
    return a.width > 0 && (a.left < b.left - 2 || a.right > b.right + 2);
  }).map((t) => t.textContent);
  found.asked = performance.getEntriesByType("resource").map((e) => e.name);
  parent.postMessage(JSON.stringify(found), "*");
}, 300));
</script>"##;

const WATCH: &str = r#"<script>window.failures = []; addEventListener("error", (e) => failures.push(e.message));
addEventListener("securitypolicyviolation", (e) => failures.push(e.blockedURI));</script>"#;

fn chromium() -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&path).flat_map(|d| names.map(|n| d.join(n))).find(|p| p.is_file())
}

fn look(browser: &Path, dir: &Path, name: &str, page: &str, width: u32) -> Value {
    let page = page.replacen("<head>", &format!("<head>{WATCH}"), 1).replacen("</body>", &format!("{DRIVER}</body>"), 1);
    std::fs::write(dir.join("page.html"), page).unwrap();
    // Windows have a least width; frames have none.
    let around = format!(
        r#"<body><iframe src="page.html" style="border:0;width:{width}px;height:900px"></iframe>
<script>addEventListener("message", (e) => {{ document.body.dataset.found = e.data; }});</script></body>"#
    );
    std::fs::write(dir.join("around.html"), around).unwrap();
    let out = Command::new(browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
        ])
        .args(["--disable-component-update", "--disable-sync", "--dump-dom", "--virtual-time-budget=8000"])
        .arg(format!("--user-data-dir={}", dir.join("profile").display()))
        .arg(format!("--window-size={},1000", width.max(600)))
        .arg(format!("file://{}", dir.join("around.html").display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&out.stdout);
    let found = dom.split("data-found=\"").nth(1).and_then(|s| s.split('"').next());
    let found = found.unwrap_or_else(|| panic!("{name} at {width}: no answer; {}", String::from_utf8_lossy(&out.stderr)));
    serde_json::from_str(&found.replace("&quot;", "\"").replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">")).unwrap()
}

#[test]
#[ignore = "needs chromium or google-chrome"]
fn pages_zoom_tell_values_overflow_nowhere_and_ask_for_nothing() {
    let browser = chromium().expect("chromium or google-chrome in the path");
    let dir = std::env::temp_dir().join(format!("im-diagnose-browser-{}", std::process::id()));
    std::fs::create_dir_all(&dir).unwrap();
    let unexplained = cases::unexplained();
    let compared = Comparison::new(unexplained.case.motor.clone(), unexplained.case.train.clone());
    let missing = cases::missing();
    let both =
        [&missing, &unexplained].map(|d| SideBySide::parse("a rather long name of a run", &d.to_json().to_string()).unwrap());
    let pages = [
        ("missing", html(&Story::new(&missing, &meta()))),
        ("unexplained", html(&Story::new(&unexplained, &Meta::default()))),
        ("adequate", html(&Story::new(&cases::adequate(), &Meta::default()))),
        ("confounded", html(&Story::new(&cases::confounded(), &meta()))),
        ("inconclusive", html(&Story::new(&cases::inconclusive(), &meta()))),
        ("without load", html(&Story::new(&cases::without_load(), &meta()))),
        ("comparison", compare_html(&compared, &Meta::default())),
        ("diverging", compare_html(&cases::diverging(), &Meta::default())),
        ("side by side", side_by_side(&both, &Meta::default())),
    ];
    // To be looked at: IM_REPORT_PAGES=FOLDER.
    let kept = std::env::var_os("IM_REPORT_PAGES").map(PathBuf::from);
    for (name, page) in &pages {
        if let Some(kept) = &kept {
            std::fs::write(kept.join(format!("{name}.html")), page).unwrap();
        }
        for width in [400, 1600] {
            let f = look(&browser, &dir, name, page, width);
            let context = format!("{name} at {width}: {f:#}");
            assert_eq!(f["errors"], serde_json::json!([]), "{context}");
            assert_eq!(f["asked"], serde_json::json!([]), "{context}");
            assert_eq!(f["cut"], serde_json::json!([]), "{context}");
            assert!(f["page"].as_u64() <= f["width"].as_u64() && f["after"].as_u64() <= f["width"].as_u64(), "{context}");
            assert_eq!(f["theme"], "dark", "{context}");
            if *name == "side by side" {
                continue;
            }
            let text = |k: &str| f[k].as_str().unwrap_or_default().to_owned();
            let span = |k: &str| -> f64 {
                let t = text(k);
                let n: Vec<f64> = t.split_once(", ").unwrap().1.split(' ').filter_map(|w| w.parse().ok()).collect();
                n[1] - n[0]
            };
            assert!((span("worst") - 1.0).abs() < 0.01 && (span("tenth") - 0.1).abs() < 0.01, "{context}");
            assert!((span("all") - 1.4).abs() < 0.01 && (span("inner") - 0.56).abs() < 0.01, "{context}");
            assert!(text("other").starts_with("second.csv"), "{context}");
            assert!(text("right") != text("inner") && text("again") == text("worst"), "{context}");
            assert!(span("dragged") < 0.45 && f["broken"] == false && f["lines"].as_u64() > Some(5), "{context}");
            let read = text("read");
            assert!(
                read.starts_with("At ") && read.contains("| measured |") && read.contains("stator current, α axis, A | "),
                "{context}"
            );
            assert!(
                (read.contains("rad/s | ") || *name == "without load") && read.contains("applied voltage α, V | "),
                "{context}"
            );
            // Within the window; near the pointer, on a narrow screen out of the way of the picture.
            let tip: Vec<f64> = f["tip"].as_array().unwrap().iter().filter_map(Value::as_f64).collect();
            let placed = if width == 400 { tip[2] > 40.0 } else { tip[2] < 400.0 };
            assert!(tip[0] >= 0.0 && tip[1] >= 0.0 && placed, "{context}");
        }
    }
    std::fs::remove_dir_all(&dir).unwrap();
}
