"""How a dataset is cited, and who answers for it."""

from hi5_common.cards.facts import CardFacts

PAPER = (
    "Hasan et al., Hi5: Synthetic Data for Inclusive, Robust, Hand Pose Estimation, "
    "arXiv:2406.03599"
)
NOBODY = "whoever ran hi5 (no name was given)"


def keeper(facts: CardFacts) -> str:
    """Return who made the dataset, as far as was told."""
    return facts.creator or NOBODY


def bibtex(facts: CardFacts) -> str:
    """Return the BibTeX entry of a dataset."""
    author = f"  author = {{{{{_braced(facts.creator)}}}}},\n" if facts.creator else ""
    return (
        f"@misc{{hi5-{str(facts.dataset_id)[-12:]},\n"
        f"{author}"
        f"  title = {{{facts.spec.name}: {facts.progress.done:,} rendered hands}},\n"
        f"  year = {{{facts.created_at.year}}},\n"
        f"  note = {{Made by hi5 {facts.hi5_version}, dataset {facts.dataset_id}}}\n"
        "}"
    )


def _braced(text: str | None) -> str:
    return " ".join((text or "").replace("{", "(").replace("}", ")").split())
