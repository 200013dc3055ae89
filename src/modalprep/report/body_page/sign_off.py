"""The last section of a page: who prepared, checked and approved it, to be filled in on paper."""

from __future__ import annotations

from modalprep.report.body_page.section import Section
from modalprep.report.body_page.table import part

ROLES = ("Prepared", "Checked", "Approved")


def sign_off(subject: str, date: str) -> Section:
    """Return the section with lines for names, dates and signatures.

    Examples
    --------
    >>> "Approved" in sign_off("arm: modal body", "2030-01-01").html
    True
    """
    html = part("sign_off.html", roles=ROLES, subject=subject, date=date)
    return Section(title="Sign-off", anchor="sign-off", html=html)
