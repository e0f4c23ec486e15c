//! The page as a browser lays it out.

use std::fs;
use std::process::Command;

use super::page;
use super::result::result_of_six;

/// The measured sizes, in pixels: height and width of the page with all closed, and the end of the first number.
const MEASURE: &str = "const page = document.querySelector('iframe').contentDocument;
    const number = page.querySelector('.answer strong').getBoundingClientRect();
    document.title = [page.body.scrollHeight, page.documentElement.scrollWidth, Math.round(number.bottom)].join(' ');";

/// Measures a page in a window of this width.
fn measure(page: &str, width: u32) -> [u32; 3] {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.html");
    let inner = page.replace('&', "&amp;").replace('"', "&quot;");
    let outer = format!(
        "<!DOCTYPE html><title></title><iframe srcdoc=\"{inner}\" style=\"border: 0; width: {width}px; height: 900px\" \
         onload=\"{}\"></iframe>",
        MEASURE.replace('"', "&quot;")
    );
    fs::write(&file, outer).unwrap();
    let output = Command::new("chromium")
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--hide-scrollbars",
        ])
        .args(["--window-size=1400,1000", "--virtual-time-budget=20000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.path().display()))
        .arg(&file)
        .output()
        .expect("Chromium runs");
    let document = String::from_utf8(output.stdout).unwrap();
    let title = document.split("<title>").nth(1).and_then(|rest| rest.split("</title>").next());
    let numbers = title.unwrap().split(' ').map(|own| own.parse().expect("the page has loaded"));
    numbers.collect::<Vec<u32>>().try_into().unwrap()
}

/// The unfolded part is read in one go, on the desk and on a telephone.
#[test]
fn the_page_is_short_and_opens_with_a_number() {
    let page = page(&result_of_six());
    let [height, width, number] = measure(&page, 1280);
    println!("at 1280 pixels the page is {height} pixels high");
    assert!((2000..6000).contains(&height), "{height}");
    assert!(width <= 1280 && number < 300, "{width} {number}");
    let [height, width, number] = measure(&page, 390);
    println!("at 390 pixels the page is {height} pixels high");
    assert!(width <= 390 && number < 400, "{width} {number}");
}
