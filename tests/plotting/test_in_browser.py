"""What a browser makes of the pictures: plotly's program draws what its Python takes unchecked."""

import pytest

from fitted import fitted
from notchflex.plotting import calibration_picture

pytestmark = [pytest.mark.browser, pytest.mark.nightly]


@pytest.fixture
def page(browser, tmp_path):
    """The picture of a fit, with what the page complained of."""
    file = tmp_path / "fit.html"
    calibration_picture(fitted()).save(file)
    page = browser.new_page(viewport={"width": 1300, "height": 1000})
    page.complaints, page.asked = [], []
    page.on("console", lambda message: page.complaints.append(message.text))
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(file.as_uri())
    page.locator(".legendtoggle").first.wait_for(state="attached")
    yield page
    page.close()


def test_fit_is_drawn_and_its_parts_are_hidden(page):
    lines = page.locator(".scatterlayer .trace").count()
    ends = 4  # of two constants; the entry of the legend may be a trace too
    entry = page.locator(".legend .traces", has_text="end of the 95 % interval")
    entry.locator(".legendtoggle").click()
    page.wait_for_function(
        f"[{ends}, {ends + 1}].includes("
        f"{lines} - document.querySelectorAll('.scatterlayer .trace').length)"
    )
    assert page.complaints == []
    assert all(url.startswith("file:") for url in page.asked)
