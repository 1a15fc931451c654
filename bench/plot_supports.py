"""Draws what `quadplan ring --json` or `quadplan cache --json` wrote: plot_supports.py RESULTS.json CHART.png|CHART.svg

Of a ring: its size against slowdown, control points per patch, live bytes over time. Of a cache: its size against hit rate and against the
time of the hull stage. With --check in place of the results it only tells whether it could. Exit 4: matplotlib is missing.
"""
import json
import os
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from PIL import Image
except ImportError:
    sys.exit(4)

# Okabe and Ito's colours, which the colour-blind tell apart.
BLACK, ORANGE, BLUE, GREEN, RED, PURPLE, GREY = (
    "#000000", "#E69F00", "#0072B2", "#009E73", "#D55E00", "#CC79A7", "#777777")
POLICIES = {
    "all": (BLACK, "D", "all points (the paper's)"),
    "direct": (BLUE, "o", "direct-mapped"),
    "clock": (ORANGE, "s", "sets, clock"),
    "shared": (GREEN, "^", "sets, shared points stay"),
}


def size_text(x, _=None):
    for unit, name in ((1 << 30, "GB"), (1 << 20, "MB"), (1 << 10, "KB")):
        if x >= unit:
            return "%g %s" % (round(x / unit, 2 if x < 10 * unit else 1), name)
    return "%g B" % x


def size_axis(axes, sizes):
    """Logarithmic, in powers of two, at most nine of them named."""
    axes.set_xscale("log", base=2)
    low, high = min(sizes).bit_length() - 1, max(sizes).bit_length()
    step = max(1, -(-(high - low) // 9))
    axes.xaxis.set_major_locator(matplotlib.ticker.FixedLocator([2.0 ** e for e in range(low, high + 1, step) if 2.0 ** e <= max(sizes) * 1.3]))
    axes.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    axes.xaxis.set_major_formatter(matplotlib.ticker.FuncFormatter(size_text))
    axes.tick_params(axis="x", labelsize=8.5)
    axes.set_xlim(min(sizes) / 1.3, max(sizes) * 1.3)


def finish(axes, title, x, y):
    axes.set_title(title)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(True, color="#e2e2e2", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def draw_slowdown(axes, result):
    rows = [r for r in result["rows"] if r["relative_throughput"] > 0]
    smallest, estimate, worst = (result[k] for k in (
        "smallest_ring_bytes_at_99_percent", "estimate_bytes", "worst_case_bytes"))
    marks = [m for m in (smallest, estimate, worst) if m > 0]
    sizes = [r["ring_bytes"] for r in result["rows"]] + marks
    slowdown = [1 / r["relative_throughput"] for r in rows]
    axes.plot([r["ring_bytes"] for r in rows], slowdown, color=BLUE, marker="o", markersize=4.5, linewidth=1.6)
    small = [r["ring_bytes"] for r in result["rows"] if r["relative_throughput"] == 0]
    if small:
        edge = min([r["ring_bytes"] for r in rows] or [max(small) * 2])
        axes.axvspan(min(sizes) / 1.3, (max(small) * edge) ** 0.5, color="#eeeeee", zorder=0)
        axes.text((min(small) / 1.3 * (max(small) * edge) ** 0.5) ** 0.5, 0.5, "smaller than\nthe largest patch",
                  rotation=90, ha="center", va="center", color=GREY, fontsize=8, transform=axes.get_xaxis_transform())
    size_axis(axes, sizes)
    top = max(slowdown + [1.1])
    if top > 3:
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
        axes.yaxis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
        axes.yaxis.set_minor_locator(matplotlib.ticker.NullLocator())
        axes.set_ylim(0.95, top * 1.15)
    else:
        axes.set_ylim(1 - 0.05 * (top - 1), top + 0.08 * (top - 1))
    for x, colour, style, label in ((smallest, RED, "-", "99 %% of scratch's throughput: %s"),
                                    (estimate, GREEN, "--", "the paper's estimate: %s"),
                                    (worst, GREY, ":", "worst-case scratch: %s")):
        if x > 0:
            axes.axvline(x, color=colour, linestyle=style, linewidth=1.3, label=label % size_text(x))
    if marks:
        axes.legend(fontsize=8.5, loc="upper right", framealpha=0.95)
    finish(axes, "size against slowdown", "ring buffer", "time, unlimited scratch = 1")


def draw_histogram(axes, result):
    width, patches = result["histogram"]["points_per_bin"], result["histogram"]["patches"]
    axes.bar([i * width for i in range(len(patches))], patches, width=width, align="edge", color=BLUE,
             edgecolor="white", linewidth=0.4)
    if patches and max(patches) > 50 * sorted(n for n in patches if n)[0]:
        axes.set_yscale("log")
        axes.set_ylim(0.7, max(patches) * 2)
        axes.yaxis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    count = result["patches_with_points"]
    if count:
        mean = result["points"] / count
        axes.axvline(mean, color=RED, linewidth=1.3, label="mean %.1f" % mean)
    without = result["patches"] - count
    if without:
        axes.plot([], [], linestyle="", label="%s patches need none" % format(without, ","))
    if count or without:
        axes.legend(fontsize=8.5, loc="upper right", handlelength=1.2)
    finish(axes, "control points per patch", "control points", "patches")


def draw_live(axes, result):
    unit, name = (1e6, "million cycles") if result["scratch"]["cycles"] >= 1e6 else (1e3, "thousand cycles")
    for live, colour in zip(result["live"], (BLACK, RED)):
        step = live["interval_cycles"]
        xs, ys = [], []
        for i, value in enumerate(live["bytes"]):
            xs += [i * step, min((i + 1) * step, live["cycles"])]
            ys += [value, value]
        label = "unlimited scratch" if live["ring_bytes"] == 0 else "ring of %s" % size_text(live["ring_bytes"])
        axes.plot([x / unit for x in xs], ys, color=colour, linewidth=1.1, label=label)
    top = max([1] + [max(live["bytes"] or [0]) for live in result["live"]]) * 1.25
    axes.set_ylim(0, top)
    axes.yaxis.set_major_locator(matplotlib.ticker.MultipleLocator(2.0 ** max(0, int(top).bit_length() - 3)))
    axes.yaxis.set_major_formatter(matplotlib.ticker.FuncFormatter(size_text))
    axes.legend(fontsize=8.5, loc="upper right", ncol=2)
    finish(axes, "live bytes over time", name, "most in each interval")


def draw_ring(result):
    figure, panels = plt.subplots(1, 3, figsize=(15, 4.6), gridspec_kw={"width_ratios": (1.25, 1, 1)})
    draw_slowdown(panels[0], result)
    draw_histogram(panels[1], result)
    draw_live(panels[2], result)
    m = result["machine"]
    figure.suptitle("%s, %s: %d SM x %d warps, retirement %s" % (
        os.path.splitext(result["mesh"])[0],
        "tolerance %g" % result["tolerance"] if "tolerance" in result else
        "factor %g" % result["tess"] if result["tess"] else "random factors",
        m["sm"], m["warps_per_sm"], m["retirement"].replace("-", " ")), y=0.985, fontsize=12)
    figure.subplots_adjust(left=0.055, right=0.99, top=0.86, bottom=0.125, wspace=0.22)
    return figure


def draw_cache_panel(axes, result, key, passes, title, y):
    sizes = [r["cache_bytes"] for r in result["rows"]]
    for policy, (colour, marker, name) in POLICIES.items():
        rows = sorted((r["cache_bytes"], r[key]) for r in result["rows"]
                      if r["policy"] == policy and r["passes"] == passes)
        if policy == "all" and rows:
            rows = rows[:1]
            axes.axhline(rows[0][1], color=colour, linewidth=0.8, linestyle=":")
        if rows:
            axes.plot([r[0] for r in rows], [r[1] for r in rows], color=colour, marker=marker, markersize=5,
                      linewidth=1.5, label=name)
    size_axis(axes, sizes)
    axes.set_ylim(bottom=0)
    finish(axes, title, "cache", y)


def draw_cache(result):
    figure, panels = plt.subplots(1, 3, figsize=(15, 4.6))
    most = max(r["passes"] for r in result["rows"])
    draw_cache_panel(panels[0], result, "hit_rate", 1, "size against hit rate, one pass", "hits of points needed")
    draw_cache_panel(panels[1], result, "hit_rate", most, "size against hit rate, %d passes" % most,
                     "hits of points needed")
    for axes in panels[:2]:
        axes.set_ylim(0, 1.02)
    draw_cache_panel(panels[2], result, "relative_hull_time", most, "hull stage, %d passes" % most,
                     "time, scratch = 1")
    panels[2].axhline(1, color=GREY, linewidth=1)
    panels[0].legend(fontsize=8.5, loc="lower right")
    figure.suptitle("%s: cache of control points, patches issued %s" % (
        os.path.splitext(result["mesh"])[0], "by their plans" if result["issue"] == "plan" else "in the mesh's order"), y=0.985, fontsize=12)
    figure.subplots_adjust(left=0.05, right=0.99, top=0.86, bottom=0.125, wspace=0.2)
    return figure


def main(source, target):
    with open(source, encoding="utf-8") as file:
        result = json.load(file)
    plt.rcParams.update({"font.size": 10, "axes.titlesize": 11, "svg.hashsalt": "quadplan"})
    figure = draw_ring(result) if "histogram" in result else draw_cache(result)
    extension = os.path.splitext(target)[1]
    temporary = target[:-len(extension)] + ".part" + extension
    metadata = {"Software": None} if extension.lower() == ".png" else {"Date": None}
    figure.savefig(temporary, dpi=110, metadata=metadata)
    if extension.lower() == ".png":
        # Half the bytes, and no difference that one could see: the chart has few colours.
        with Image.open(temporary) as image:
            image.convert("RGB").quantize(255, kmeans=2).save(temporary, optimize=True)
    os.replace(temporary, target)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: plot_supports.py RESULTS.json CHART.png|CHART.svg")
    if sys.argv[1] == "--check":  # the libraries are there
        sys.exit(0)
    try:
        main(sys.argv[1], sys.argv[2])
    except (OSError, ValueError, KeyError) as problem:
        sys.exit("plot_supports.py: %s" % problem)
