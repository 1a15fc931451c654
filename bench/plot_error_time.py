"""Draws what `quadplan bench error-time --json` wrote: plot_error_time.py RESULTS.json CHART.png|CHART.svg

Time a sample against the largest and the RMS position error, both logarithmic. With --check in place of the results it only tells whether it could. Exit 4: matplotlib is missing.
"""
import json
import os
import sys

try:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.lines import Line2D
    from PIL import Image
except ImportError:
    sys.exit(4)

# Okabe and Ito's colours, which the colour-blind tell apart; black is quadplan's own.
FLOAT, DOUBLE = "#000000", "#D55E00"
PEERS = {  # prefix of the series: colour, name
    "osd-cpu": ("#999999", "OpenSubdiv Osd CPU, float, 1 thread"),
    "osd-omp": ("#0072B2", "OpenSubdiv Osd OpenMP, float"),
    "far-double": ("#56B4E9", "OpenSubdiv Far, double"),
    "bfr-double": ("#009E73", "OpenSubdiv Bfr, double"),
    "bfr": ("#66C28A", "OpenSubdiv Bfr, float"),
    "embree": ("#CC79A7", "Embree, float"),
}
MARKERS = {"bspline": "o", "gregory": "s", "bilinear": "^", "default": "*", "": "D", "n": "v", "moved": "P"}
KINDS = {
    "o": "B-spline end caps",
    "s": "Gregory end caps",
    "^": "bilinear end caps",
    "D": "Bfr; Embree one by one",
    "*": "Bfr, default levels",
    "v": "Embree N, patches cached",
    "P": "Embree N, moved positions",
}
FLOOR = 1e-17  # an error of 0 has no place on a logarithmic axis


def look(series):
    """Colour and marker of a peer's series."""
    prefix = next(p for p in PEERS if series.startswith(p))
    rest = series[len(prefix):].strip("-/")
    return PEERS[prefix][0], MARKERS[rest.split("-")[-1]], prefix


def value(c, key):
    return max(c[key], FLOOR)


def stairs(points):
    """The lower left border of points, as the corners of a flight of stairs."""
    xs, ys = [], []
    for x, y in sorted(points):
        if not ys or y < ys[-1]:
            if ys:
                xs.append(x)
                ys.append(ys[-1])
            xs.append(x)
            ys.append(y)
    return xs, ys


def draw_panel(axes, result, key, label):
    ours = [c for c in result["configurations"] if c["library"] == "quadplan" and c["nonfinite"] == 0]
    peers = {}
    for c in result["configurations"]:
        if c["library"] != "quadplan" and c["nonfinite"] == 0:
            peers.setdefault(c["series"], []).append(c)
    used = set()
    for series, levels in peers.items():
        colour, marker, prefix = look(series)
        if prefix == "osd-cpu" and result["threads"] > 1:
            continue  # one thread beside several would be no comparison
        used.add((prefix, marker))
        axes.plot([c["ns_per_sample"] for c in levels], [value(c, key) for c in levels], color=colour, marker=marker,
                  markersize={"*": 10, "P": 8, "v": 7}.get(marker, 5.5), linewidth=0.8,
                  markeredgecolor="white", markeredgewidth=0.5,
                  alpha=0.9, zorder=3 + (prefix == "embree"))
    xs, ys = stairs([(c["ns_per_sample"], value(c, key)) for c in ours])
    right, top = max(c["ns_per_sample"] for c in result["configurations"]) * 2, 10
    axes.fill_between([xs[0]] + xs + [right], [top] + ys + [ys[-1]], FLOOR * 1e-3, step=None, color="#f3ece0", zorder=0)
    axes.fill_between([1e-3, xs[0]], top, FLOOR * 1e-3, color="#f3ece0", zorder=0)
    axes.plot([xs[0]] + xs + [right], [top] + ys + [ys[-1]], color="#7a4b00", linewidth=1.6, zorder=4)
    for precision, colour in (("float", FLOAT), ("double", DOUBLE)):
        some = [c for c in ours if c["precision"] == precision and "tolerance" in c]
        axes.scatter([c["ns_per_sample"] for c in some], [value(c, key) for c in some], s=34, marker="D",
                     facecolor="#F0E442", edgecolor=colour, linewidth=0.9, zorder=5.5)
        for exact, face in ((True, colour), (False, "white")):
            some = [c for c in ours if c["precision"] == precision and c["exact_tail"] == exact and "tolerance" not in c]
            axes.scatter([c["ns_per_sample"] for c in some], [value(c, key) for c in some], s=20, facecolor=face,
                         edgecolor=colour, linewidth=0.8, zorder=5 if exact else 4.5)
    axes.set_xscale("log")
    axes.set_yscale("log")
    everything = [c for c in result["configurations"]
                  if result["threads"] == 1 or not c["series"].startswith("osd-cpu")]
    times = [c["ns_per_sample"] for c in everything]
    errors = [value(c, key) for c in everything]
    axes.set_xlim(min(times) * 0.7, max(times) * 1.4)
    axes.set_ylim(min(errors) * 0.2, max(errors) * 5)
    axes.xaxis.set_major_locator(matplotlib.ticker.LogLocator(subs=(1, 2, 5)))
    axes.xaxis.set_major_formatter(matplotlib.ticker.FormatStrFormatter("%g"))
    axes.xaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    axes.yaxis.set_major_locator(matplotlib.ticker.LogLocator(numticks=12))
    axes.yaxis.set_minor_locator(matplotlib.ticker.NullLocator())
    axes.grid(True, color="#dddddd", linewidth=0.5, zorder=1)
    axes.set_axisbelow(True)
    axes.set_xlabel("processor time of all threads, ns a sample" if result["clock"] == "processor" else "time, ns a sample")
    axes.set_ylabel(label)
    return used


def legend_handles(used, tolerances):
    def dot(face, edge, marker="o"):
        return Line2D([], [], linestyle="", marker=marker, markersize=5, markerfacecolor=face, markeredgecolor=edge)

    handles = [dot(FLOAT, FLOAT), dot("white", FLOAT), dot(DOUBLE, DOUBLE), dot("white", DOUBLE),
               Line2D([], [], color="#7a4b00", linewidth=1.6)]
    labels = ["quadplan, float", "quadplan, float, no exact tail", "quadplan, double",
              "quadplan, double, no exact tail", "quadplan's Pareto front; shaded: beyond it"]
    if tolerances:
        handles[4:4] = [dot("#F0E442", FLOAT, "D"), dot("#F0E442", DOUBLE, "D")]
        labels[4:4] = ["quadplan, float, tolerances", "quadplan, double, tolerances"]
    for prefix, (colour, name) in PEERS.items():
        if any(p == prefix for p, _ in used):
            handles.append(Line2D([], [], color=colour, linewidth=3))
            labels.append(name)
    for marker, name in KINDS.items():
        if any(m == marker for _, m in used):
            handles.append(Line2D([], [], linestyle="", marker=marker, color="#666666", markersize=6))
            labels.append(name)
    return handles, labels


def main(source, target):
    with open(source, encoding="utf-8") as file:
        result = json.load(file)
    plt.rcParams.update({"font.size": 10, "axes.titlesize": 11, "svg.hashsalt": "quadplan"})
    figure, panels = plt.subplots(1, 2, figsize=(12, 6.4))
    used = draw_panel(panels[0], result, "position_max", "largest position error, of the diagonal")
    draw_panel(panels[1], result, "position_rms", "RMS position error, of the diagonal")
    name = os.path.splitext(result["mesh"])[0]
    threads = "1 thread" if result["threads"] == 1 else "%d threads" % result["threads"]
    figure.suptitle("%s: %s samples off the grid, %s, medians of %d rounds; position and tangents or normal"
                    % (name, format(result["samples"], ","), threads, result["repeats"]), y=0.975, fontsize=12)
    handles, labels = legend_handles(used, any("tolerance" in c for c in result["configurations"]))
    figure.legend(handles, labels, loc="lower center", ncol=4, frameon=False, fontsize=9, handletextpad=0.5,
                  columnspacing=1.6)
    rows = (len(labels) + 3) // 4
    figure.subplots_adjust(left=0.065, right=0.985, top=0.92, bottom=0.115 + 0.034 * rows, wspace=0.17)
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
        sys.exit("usage: plot_error_time.py RESULTS.json CHART.png|CHART.svg")
    if sys.argv[1] == "--check":  # the libraries are there
        sys.exit(0)
    try:
        main(sys.argv[1], sys.argv[2])
    except (OSError, ValueError, KeyError) as problem:
        sys.exit("plot_error_time.py: %s" % problem)
