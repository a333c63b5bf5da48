"""Recorded runs in a real browser: played, jumped to, exported, decided again with other limits."""

import os
import signal
import subprocess

import pytest
from helpers.browser import Browser
from helpers.small_run import bag  # noqa: F401
from helpers.waiting import DEADLINE_S, wait_for


@pytest.fixture
def view():
    """Return a function that serves bags, and returns where."""
    processes = []

    def serve(*arguments):
        words = ["metacontrol", "view", *map(str, arguments), "--port", "0"]
        process = subprocess.Popen(
            words, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"}
        )
        processes.append(process)
        return process.stdout.readline().split()[0]

    yield serve
    for process in processes:
        process.send_signal(signal.SIGINT)
        process.wait(DEADLINE_S)


@pytest.fixture
def page():
    with Browser() as browser:
        yield browser


def test_run_is_played_and_jumped_in(bag, view, page):  # noqa: F811
    page.open(view(bag()))
    page.wait_for_text("f_move: camera_slow", "#summary")
    page.wait_for_text("failed: laser", "#summary")
    page.click("why", "#timeline")
    page.wait_for_text("Candidates, the best first", "#decisions")
    page.wait_for_text("scan_slow → camera_slow", "#decisions")
    page.ask("document.querySelector('.controls input[type=range]').value = 101")
    page.ask("document.querySelector('.controls input[type=range]').dispatchEvent(new Event('input', {bubbles: true}))")
    page.wait_for_text("f_move: scan_slow", "#summary")
    assert "failed" not in page.text("#summary")
    page.ask("document.querySelector('[aria-label=\"To the next decision\"]').click()")
    page.wait("Math.abs(document.querySelector('.controls input[type=range]').value - 105) < 0.5", "the decision")
    page.ask("document.querySelector('.controls select').value = 20")
    page.ask("document.querySelector('.controls select').dispatchEvent(new Event('change', {bubbles: true}))")
    page.click("Play", ".controls")
    page.wait_for_text("f_move: camera_slow", "#summary")
    page.wait("document.querySelector('.controls button').innerText === 'Play'", "the end")
    assert page.errors() == []


def test_other_limits_are_side_by_side(bag, view, page):  # noqa: F811
    page.open(view(bag()))
    page.wait_for_text("With other limits", "#replay")
    page.ask("document.querySelector('#replay input[name=safety]').value = '0.1'")
    page.click("Decide again", "#replay")
    page.wait_for_text("with safety 0.1", "#replay")
    page.wait_for_text("scan_slow → camera_slow", "#replay")


def test_run_is_chosen_of_several(bag, view, page, tmp_path):  # noqa: F811
    bag("first.bag")
    bag("second.bag")
    page.open(view(tmp_path))
    page.wait_for_text("first", "header")
    page.ask("document.querySelectorAll('.controls select')[1].value = 'second'")
    page.ask("document.querySelectorAll('.controls select')[1].dispatchEvent(new Event('change', {bubbles: true}))")
    page.wait_for_text("second", "header")


def test_exported_file_shows_the_run_without_a_server(bag, page, tmp_path):  # noqa: F811
    target = tmp_path / "run.html"
    subprocess.run(["metacontrol", "view", bag(), "--export", target], check=True, timeout=DEADLINE_S)
    page.open(target.as_uri())
    page.wait_for_text("f_move: camera_slow", "#summary")
    page.wait_for_text("An exported page can't decide again", "#replay")
    assert page.errors() == []


def test_page_is_as_wide_as_a_phone_and_all_is_reached_by_keys(bag, view, page):  # noqa: F811
    page.resize(380, 800, mobile=True)
    page.open(view(bag()))
    page.wait_for_text("f_move: camera_slow", "#summary")
    wait_for(lambda: page.ask("document.documentElement.scrollWidth <= innerWidth"), "nothing is cut off at the right")
    page.press("Tab", 9)
    assert page.ask("document.activeElement.innerText") == "Skip to the summary"
    for _ in range(8):  # the links to the parts of the page
        page.press("Tab", 9)
    assert page.ask("document.activeElement.innerText") == "Play"
    page.press("Enter", 13)
    page.wait("document.querySelector('.controls button').innerText === 'Pause'", "it plays")
