"""Puts the documents of `calibench prove --json`, one after the other on standard input, into one table, worst ratio first."""

import json
import sys


def documents(text):
    decoder, at = json.JSONDecoder(), 0
    while text[at:].strip():
        at += len(text[at:]) - len(text[at:].lstrip())
        document, at = decoder.raw_decode(text, at)
        yield document


def number(x, digits):
    return "-" if x is None else f"{x:.{digits}f}"


def fair(proofs, k):
    known = [p["predicted_over_measured"][k] for p in proofs if p["predicted_over_measured"][k] is not None]
    return f"{sum(0.8 <= x <= 1.25 for x in known)} of {len(known)}"


proofs = [p for document in documents(sys.stdin.read()) for p in document["proofs"]]
ratio = lambda p: p["recommended_mm"] / p["default_mm"]
proofs.sort(key=ratio, reverse=True)
ratios = [ratio(p) for p in proofs]
print(f"{len(proofs)} divisions. Recommended over default, rms on rows left out: mean {sum(ratios) / len(ratios):.3f}, largest {max(ratios):.3f}, "
      f"at most 1.02 in {sum(r <= 1.02 for r in ratios)}. Predicted over measured mean error within 0.8 to 1.25: default model {fair(proofs, 0)}, "
      f"recommended {fair(proofs, 1)}.\n")
print("| data | left out | postures fitted, judged | geometry mm | default mm | recommended mm | which | ratio | predicted / measured: default | recommended | verdict | s |")
print("|---|---|---|---|---|---|---|---|---|---|---|---|")
for p in proofs:
    fitted, judged = p["postures"]
    first, second = (number(x, 2) for x in p["predicted_over_measured"])
    print(f"| {p['robot']} | {p['fold']} | {fitted}, {judged} | {number(p['geometry_mm'], 3)} | {p['default_mm']:.3f} | {p['recommended_mm']:.3f} "
          f"| {p['kind']} | {ratio(p):.3f} | {first} | {second} | {p['verdict']} | {p['seconds']:.1f} |")
