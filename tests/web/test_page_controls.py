"""What a reader does with a report: time, switches, plots, keys, views, themes, paper; and browsers that lack something."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from support.browser import Visit
from support.small_report import CLEARANCE, FLOOR, T

Windows = Callable[..., Visit]

WITHOUT_WEBGL = """const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    return /webgl/.test(kind) ? null : get.call(this, kind, ...more); };"""


@pytest.fixture(scope="module")
def opened(browser: Any, small: Path) -> Iterator[Visit]:
    """The small page in a window."""
    window = Visit(browser).open(small)
    yield window
    window.close()


@pytest.fixture
def window(opened: Visit) -> Iterator[Visit]:
    """The small page at its first view, as after loading, which takes longer; it has to stay without complaints."""
    opened.page.mouse.move(1, 1)
    opened.page.evaluate("(spacearm.view(2), spacearm.view(0), document.activeElement.blur(), scrollTo(0, 0))")
    opened.frame()
    yield opened
    assert opened.errors == []


def test_the_title_block_and_the_verdict_are_told(window: Visit) -> None:
    page = window.page
    assert page.title() == page.locator("h1").inner_text() == "Small <report> & more"
    assert page.locator(".block .cell").count() == 7
    assert page.locator(".chip").inner_text().split() == ["\u2713", "Proven"]  # a sign and a word, not a colour alone
    assert page.locator(".verdict .text").inner_text() == "A motion was found."


# ---- Time ------------------------------------------------------------------------------------------------------------


def test_keys_move_the_time(window: Visit) -> None:
    keys = window.page.keyboard
    for key, expected in (
        ("ArrowRight", 0.1),
        ("Shift+ArrowRight", 1.1),
        ("ArrowLeft", 1.0),
        ("End", 10),
        ("Home", 0),
        ("m", 5),
    ):
        keys.press(key)
        assert window.time() == pytest.approx(expected, abs=1e-3), key


def test_space_plays_and_pauses_and_the_end_stops(window: Visit) -> None:
    page = window.page
    page.keyboard.press("Space")
    page.wait_for_function("Number(document.querySelector('.player input').value) > 0.05")
    assert page.locator(".play").get_attribute("aria-label") == "pause"
    page.keyboard.press("Space")
    stopped = window.time()
    window.frame()
    assert window.time() == stopped
    page.evaluate("spacearm.seek(9.9)")
    page.locator(".player select").select_option("8")
    page.locator(".play").click()
    page.wait_for_function("document.querySelector('.play').ariaLabel === 'play'")
    assert window.time() == 10


def test_nothing_is_drawn_while_nothing_changes(window: Visit) -> None:
    """No loop runs behind a page that is only looked at."""
    window.page.evaluate("""(() => { window.asked = 0; const ask = requestAnimationFrame;
        window.requestAnimationFrame = (f) => { window.asked++; return ask(f); }; })()""")
    window.page.wait_for_timeout(300)
    assert window.page.evaluate("asked") == 0


def test_an_address_chooses_view_and_time(visit: Windows, small: Path) -> None:
    window = visit().open(small, "#view=2&t=7")
    assert window.page.locator(".tab[aria-current=true]").inner_text().endswith("swarm")
    assert window.time() == 7


# ---- The picture -----------------------------------------------------------------------------------------------------


def test_switches_and_their_keys_change_the_picture(window: Visit) -> None:
    page = window.page
    window.page.evaluate("spacearm.seek(5.5)")
    chips = page.locator(".switch:visible").evaluate_all("(all) => all.map((one) => one.dataset.toggle)")
    assert {"shapes", "path", "axes", "closest", "targets", "grid"} <= set(chips)
    letters = {"shapes": "c", "path": "p", "axes": "a", "closest": "d", "targets": "t", "grid": "r"}
    for toggle, letter in letters.items():
        before, chip = window.picture(), page.locator(f"[data-toggle={toggle}]")
        was = chip.get_attribute("aria-pressed")
        chip.click()
        assert chip.get_attribute("aria-pressed") != was
        assert window.picture() != before, toggle
        page.keyboard.press(letter)
        assert chip.get_attribute("aria-pressed") == was
        assert window.picture() == before, toggle


def test_viewpoints_change_the_picture(window: Visit) -> None:
    seen = set()
    for digit in "12345":
        window.page.keyboard.press(digit)
        seen.add(window.picture())
    assert len(seen) == 5
    window.page.locator("[data-look=top]").click()
    window.page.keyboard.press("4")
    assert window.picture() in seen


def test_the_closest_pair_is_told(window: Visit) -> None:
    window.page.evaluate("spacearm.seek(0)")
    assert window.page.locator(".near").inner_text() == "closest: fore - ball: 20.0 mm"


# ---- Plots -----------------------------------------------------------------------------------------------------------


def cursor(window: Visit, plot: str, which: str = "at") -> float | None:
    """Where a plot's cursor is in the window; None if it is not shown."""
    line = window.page.locator(f'[data-plot="{plot}"] .line.{which}')
    return (
        window.rect(f'[data-plot="{plot}"] .line.{which}')["x"]
        if line.is_visible() or line.get_attribute("hidden") is None
        else None
    )


def test_the_cursors_of_all_plots_follow_the_time(window: Visit) -> None:
    for t in (0.0, 2.5, 10.0):
        window.page.evaluate(f"spacearm.seek({t})")
        for plot in ("joints", "rates", "clearance"):
            at = cursor(window, plot)
            assert at is not None
            assert at == pytest.approx(window.point_in(plot, t)[0], abs=1.5), (plot, t)


def test_a_press_in_a_plot_sets_the_time_and_a_drag_moves_it(window: Visit) -> None:
    mouse = window.page.mouse
    mouse.move(*window.point_in("joints", 3))
    mouse.down()
    assert window.time() == pytest.approx(3, abs=0.05)
    mouse.move(*window.point_in("joints", 6), steps=2)
    mouse.up()
    assert window.time() == pytest.approx(6, abs=0.05)
    mouse.move(*window.point_in("joints", 8))
    assert window.time() == pytest.approx(6, abs=0.05)


def test_the_pointer_shows_the_values_there_in_all_plots(window: Visit) -> None:
    window.page.mouse.move(*window.point_in("rates", 4, 0.95))
    t = float(window.page.locator('[data-plot="rates"] .told').inner_text().split()[0])
    assert t == pytest.approx(4, abs=0.05)
    assert cursor(window, "joints", "hover") == pytest.approx(window.point_in("joints", 4)[0], abs=2)
    shown = window.values("joints")
    assert float(shown["shoulder"]) == pytest.approx(np.degrees(0.1 * t), abs=0.1)
    assert float(shown["elbow"]) == pytest.approx(np.degrees(0.02 * t**2), abs=0.1)
    window.page.mouse.move(5, 5)
    assert float(window.values("joints")["shoulder"]) == 0


def test_values_below_the_floor_of_a_logarithmic_axis_are_told_as_they_are(window: Visit) -> None:
    window.page.evaluate("spacearm.seek(5)")
    least = float(CLEARANCE[T == 5][0])
    assert least < FLOOR
    assert float(window.values("clearance")["fore - ball"]) == pytest.approx(least)
    assert "below 0.1 " in window.page.locator('[data-plot="clearance"] .note').inner_text()


def pixels(window: Visit, plot: str) -> str:
    window.frame()
    return window.page.evaluate(f"""document.querySelector('[data-plot="{plot}"] canvas').toDataURL()""")


def test_a_press_on_a_label_shows_a_curve_alone_in_all_plots_of_the_same_curves(window: Visit) -> None:
    page, before = window.page, pixels(window, "rates")
    label = page.locator('[data-plot="joints"] .legend button').first
    label.click()
    assert page.locator('[data-plot="rates"] .legend button').first.get_attribute("aria-pressed") == "true"
    assert "\u00b1180 deg" in page.locator('[data-plot="joints"] .told').inner_text()
    page.mouse.move(5, 5)
    assert pixels(window, "rates") != before
    label.click()
    page.mouse.move(5, 5)
    assert pixels(window, "rates") == before


def test_a_plot_can_be_made_larger(window: Visit) -> None:
    size = "document.querySelector('[data-plot=rates] canvas').width"
    before = window.page.evaluate(size)
    button = window.page.locator('[aria-label="larger: Joint rates"]')
    window.page.set_viewport_size({"width": 1920, "height": 1080})
    window.frame()
    button.click()
    window.page.wait_for_function(f"{size} > {1.5 * before}")
    window.page.set_viewport_size({"width": 1280, "height": 800})


def test_shift_and_drag_shows_a_part_and_a_double_click_all(window: Visit) -> None:
    page, before = window.page, pixels(window, "rates")
    page.mouse.move(*window.point_in("joints", 2))
    page.keyboard.down("Shift")
    page.mouse.down()
    page.mouse.move(*window.point_in("joints", 4), steps=2)
    page.mouse.up()
    page.keyboard.up("Shift")
    page.evaluate("spacearm.seek(3)")
    middle = window.point_in("rates", 5)[0]
    assert cursor(window, "rates") == pytest.approx(middle, abs=4)
    page.mouse.dblclick(*window.point_in("joints", 5))
    page.evaluate("spacearm.seek(0)")
    page.mouse.move(5, 5)
    assert pixels(window, "rates") == before


# ---- Views, sections, help ---------------------------------------------------------------------------------------------


def test_views_are_chosen(window: Visit) -> None:
    page = window.page
    page.locator(".tab", has_text="swarm").click()
    assert page.locator(".chip").inner_text().split()[1:] == ["12", "iterations"]
    page.keyboard.press("ArrowRight")
    assert window.time() == 1
    before = window.picture()
    page.keyboard.press("End")
    assert window.picture() != before
    assert "5 faint lines" in page.locator('[data-plot="fitness"] .rest').inner_text()
    page.keyboard.press("]")
    assert page.locator(".left").is_hidden()
    page.locator("summary", has_text="Numbers").click()
    page.wait_for_selector('[data-plot="size"] canvas')
    page.keyboard.press("]")
    assert page.locator(".tab[aria-current=true]").inner_text().endswith("arm")


def test_sections_fold_and_commands_are_copied(window: Visit) -> None:
    page = window.page
    table = page.locator("summary", has_text="Pairs")
    assert page.locator("td", has_text="pair 3").is_hidden()
    table.click()
    assert page.locator("td", has_text="pair 3").is_visible()
    window.context.grant_permissions(["clipboard-read", "clipboard-write"])
    page.locator(".copy").click()
    page.wait_for_selector(".copy[data-said=copied]")


def test_help_lists_the_keys(window: Visit) -> None:
    page = window.page
    page.keyboard.press("?")
    assert page.locator("dialog.help").is_visible()
    assert "play, pause" in page.locator("dialog.help").inner_text()
    page.keyboard.press("Escape")
    assert page.locator("dialog.help").is_hidden()


def test_everything_that_is_pressed_has_a_name_and_can_be_reached(window: Visit) -> None:
    nameless = window.page.locator("button, select, input, canvas[tabindex]").evaluate_all(
        "(all) => all.filter((one) => !(one.ariaLabel || one.textContent.trim())).map((one) => one.outerHTML)"
    )
    assert nameless == []
    window.page.keyboard.press("Tab")
    outline = window.page.evaluate("getComputedStyle(document.activeElement).outlineStyle")
    assert outline == "solid"


# ---- Themes, phone, paper, old browsers ------------------------------------------------------------------------------


def test_the_theme_is_the_systems_until_the_button_is_pressed(visit: Windows, small: Path) -> None:
    window = visit(theme="dark").open(small)
    theme = "document.documentElement.dataset.theme"
    assert window.page.evaluate(theme) == "dark"
    before = window.picture()
    window.page.locator("[aria-label='light or dark']").click()
    assert window.page.evaluate(theme) == "light"
    assert window.picture() != before
    window.open(small)
    assert window.page.evaluate(theme) == "light"  # for the session
    assert window.errors == []


def test_a_phone_has_the_player_at_hand(visit: Windows, small: Path) -> None:
    window = visit(size=(390, 844), touch=True).open(small)
    page = window.page
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert window.rect(".picture")["y"] < 400
    page.locator(".section").last.scroll_into_view_if_needed()
    player = window.rect(".player")
    assert 600 < player["y"] < player["y"] + player["height"] <= 844.5
    page.locator('[data-plot="joints"]').scroll_into_view_if_needed()
    page.touchscreen.tap(*window.point_in("joints", 5))
    assert window.time() == pytest.approx(5, abs=0.1)


def test_paper_has_a_still_and_all_sections(visit: Windows, small: Path) -> None:
    window = visit(theme="dark").open(small)
    page = window.page
    page.evaluate("(spacearm.seek(5), dispatchEvent(new Event('beforeprint')))")
    page.emulate_media(media="print")
    assert page.locator("img.still").is_visible()
    assert page.locator("img.still").evaluate("(one) => one.naturalWidth") > 100
    assert page.locator("td", has_text="pair 3").is_visible()
    assert page.locator(".player").is_hidden()
    assert "at 5.00 s" in page.locator(".instant").inner_text()
    assert page.evaluate("document.documentElement.dataset.theme") == "light"
    page.emulate_media(media="screen")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.locator("td", has_text="pair 3").is_hidden()
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"


def test_without_webgl_there_are_the_plots_and_a_sentence(visit: Windows, small: Path) -> None:
    window = visit()
    window.page.add_init_script(WITHOUT_WEBGL)
    window.open(small)
    assert "WebGL" in window.page.locator(".without").inner_text()
    window.page.keyboard.press("End")
    assert window.time() == 10
    assert window.values("joints")["shoulder"] == "57.3"
    assert np.array(window.page.evaluate("spacearm.tip(0, 0)")).reshape(4, 4)[3] == pytest.approx([2, 0, 0, 1])
    assert window.errors == []


def test_an_old_browser_is_told_so(visit: Windows, small: Path) -> None:
    window = visit()
    window.page.add_init_script("delete window.DecompressionStream")
    window.open(small)
    assert "too old" in window.page.locator("[role=alert]").inner_text()


def test_a_file_that_was_cut_is_told(visit: Windows, small: Path, tmp_path: Path) -> None:
    cut = base64.b64encode(gzip.compress(b'{"spacearm-report": 1')[:-12]).decode()
    text = small.read_text(encoding="utf-8")
    start = text.index('base64">') + len('base64">')
    path = tmp_path / "cut.html"
    path.write_text(text[:start] + cut + text[text.index("</script>", start) :], encoding="utf-8")
    window = visit().open(path)
    assert "cut short" in window.page.locator("[role=alert]").inner_text()
