"""The benchmark's page: tables in Markdown, and the plot of error against time."""

from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

PLOT = "render.svg"
BESIDE = ("label", "backdrop", "ahead")
"""Phases that another thread goes through while Cycles traces."""
GROUP_STYLES = {
    "front": ("o", "tab:blue"),
    "preset": ("*", "tab:red"),
    "straightforward": ("s", "tab:gray"),
    "ablation": (".", "tab:olive"),
}


def write_page(out: Path, document: dict[str, Any]) -> None:
    """Write render.md and its plot beside results.json."""
    _plot(out / PLOT, document)
    (out / "render.md").write_text(page(document), encoding="utf-8")


def page(document: dict[str, Any]) -> str:
    """Return the page of a measurement."""
    machine = document["machine"]
    samples = document["reference_samples"]
    scenes = len(document["ways"][0]["scenes"])
    made_on = (
        f"{machine['processor']}, {machine['cores']} cores, {machine['threads']} threads; "
        f"bpy {machine['bpy']}, Python {machine['python']}, hi5 {machine['hi5']}; "
        f"load when it began {machine['load']:.1f}."
    )
    made_of = (
        f"{scenes} scenes of {document['side_px']} px, seed {document['seed']}; each against a "
        f"reference of {samples[0]} + {samples[1]} samples without denoiser and clamping; "
        f"each image timed {document['repeats']} times, after one that does not count."
    )
    lines = [
        "# Run time against error",
        "",
        made_on,
        made_of,
        "",
        "Errors are medians over scenes, inside the hand, without the reference's own noise. FLIP",
        f"cannot be freed of it: between the reference's halves it is {_floor(document):.3f}.",
        "",
        f"![Error against time]({PLOT})",
        "",
        *_table(document["ways"], ("preset", "straightforward", "front")),
        "",
        f"On the front: {', '.join(document['pareto'])}.",
    ]
    for name, found in document.get("speedups", {}).items():
        ratios = [ratio for ratio, _ in found["scenes"].values()]
        bound = sum(at_bound for _, at_bound in found["scenes"].values())
        lines.append(
            f"`{name}` is {found['median']:.1f} times as fast as the straightforward way at equal "
            f"error (median; {min(ratios):.1f} to {max(ratios):.1f}; {bound} scenes at an end of "
            "its curve)."
        )
    if "maps" in document:
        lines += [
            "",
            "## Where the errors lie",
            "",
            f"![Insets and FLIP maps]({document['maps']})",
            "",
            "From the scene where `standard` is worst to the one where it is best.",
        ]
    ablations = [way for way in document["ways"] if way["way"]["group"] == "ablation"]
    standard = next((w for w in document["ways"] if w["way"]["name"] == "standard"), None)
    if ablations and standard:
        lines += ["", "## What each saving saves", "", *_ablations(standard, ablations)]
    if standard:
        lines += ["", "## Where a standard image's time goes", "", *_phases(standard)]
    if "confirmation" in document:
        lines += ["", "## On other scenes", "", *_table(document["confirmation"], ("preset",))]
    return "\n".join(lines) + "\n"


def _floor(document: dict[str, Any]) -> float:
    floor: float = document["ways"][0]["median_errors"]["floor_flip"]
    return floor


def _table(ways: Sequence[dict[str, Any]], groups: Sequence[str]) -> list[str]:
    rows = [
        "| way | s an image | PSNR, dB | worst scene | at 256 px | relMSE | FLIP |",
        "|---|---|---|---|---|---|---|",
    ]
    for way in ways:
        if way["way"]["group"] in groups:
            errors = way["median_errors"]
            rows.append(
                f"| {way['way']['name']} | {way['median_s']:.2f} | {errors['psnr_db']:.1f} | "
                f"{way['worst_psnr_db']:.1f} | {errors['crop_psnr_db']:.1f} | "
                f"{errors['relmse']:.5f} | {errors['flip']:.3f} |"
            )
    return rows


def _ablations(standard: dict[str, Any], ways: Sequence[dict[str, Any]]) -> list[str]:
    few = len(ways[0]["scenes"])
    rows = [
        f"On {few} scenes against the standard preset: time as a share of its time, error as a",
        "difference in dB; medians of what each scene says.",
        "",
        "| instead | time | PSNR | at 256 px |",
        "|---|---|---|---|",
    ]
    kept = {scene["index"]: scene for scene in standard["scenes"]}
    for way in ways:
        pairs = [(scene, kept[scene["index"]]) for scene in way["scenes"]]
        ratio = median(one["median_s"] / other["median_s"] for one, other in pairs)
        changes = [
            median(one["errors"][name] - other["errors"][name] for one, other in pairs)
            for name in ("psnr_db", "crop_psnr_db")
        ]
        rows.append(
            f"| {way['way']['name']} | x {ratio:.2f} | {changes[0]:+.2f} | {changes[1]:+.2f} |"
        )
    return rows


def _phases(way: dict[str, Any]) -> list[str]:
    phases = way["phases_s"]
    total = phases["total"]
    outside = f"{100.0 * way['median_overhead']:.0f} %"
    rows = [
        f"Outside Cycles' sampling and denoising: {outside} (median over scenes). What is marked",
        "is done while Cycles traces, and costs it a share of a processor.",
        "",
        "| phase | s | share |",
        "|---|---|---|",
    ]
    for name, seconds in phases.items():
        told = f"{name} (meanwhile)" if name in BESIDE else name
        rows.append(f"| {told} | {seconds:.3f} | {100.0 * seconds / total:.1f} % |")
    return rows


def _plot(path: Path, document: dict[str, Any]) -> None:
    """Draw relMSE over seconds, both logarithmic; Monte Carlo alone falls with slope -1."""
    import matplotlib as mpl

    mpl.use("Agg")
    mpl.rcParams["svg.hashsalt"] = "hi5"
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 4.5), layout="constrained")
    for group, (marker, colour) in GROUP_STYLES.items():
        ways = [way for way in document["ways"] if way["way"]["group"] == group]
        if not ways:
            continue
        seconds = [way["median_s"] for way in ways]
        for axis, error in zip(axes, ("relmse", "psnr_db"), strict=True):
            axis.scatter(
                seconds,
                [way["median_errors"][error] for way in ways],
                marker=marker,
                color=colour,
                label=group,
            )
    front = [way for way in document["ways"] if way["way"]["name"] in document["pareto"]]
    front.sort(key=lambda way: way["median_s"])
    axes[1].plot(
        [way["median_s"] for way in front],
        [way["median_errors"]["psnr_db"] for way in front],
        color="tab:blue",
        linewidth=1,
    )
    for axis, label in zip(axes, ("relMSE", "PSNR in the hand, dB"), strict=True):
        axis.set_xscale("log")
        axis.set_xlabel("seconds an image")
        axis.set_ylabel(label)
        axis.grid(which="both", alpha=0.3)
    axes[0].set_yscale("log")
    axes[0].legend()
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)
