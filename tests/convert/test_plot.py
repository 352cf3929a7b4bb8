"""Plots: the SVG as XML, the PNG as ImageMagick sees it."""

import math
import unittest
import xml.etree.ElementTree as ElementTree

from example_log import START, VALID, Converted, peer

SVG = "{http://www.w3.org/2000/svg}"


class Plot(Converted):
    def svg(self, *fields, exit_code=0):
        out = self.folder / "out.svg"
        options = [word for field in fields for word in ("--field", field)]
        said = self.axlecast("plot", *options, "-o", out, "--force", exit_code=exit_code)
        return ElementTree.parse(out).getroot() if exit_code == 0 else said

    @staticmethod
    def texts(svg):
        return [text.text for text in svg.iter(SVG + "text")]

    @staticmethod
    def curves(svg):
        """The points of every piece of every curve. A single point is drawn as a line to itself."""
        pieces = [piece for path in svg.iter(SVG + "path") for piece in path.get("d").split("M")[1:]]
        return [list(dict.fromkeys(tuple(map(float, pair.split())) for pair in piece.split("L"))) for piece in pieces]

    def turning(self, count=2_000, period=1_000, skip=()):
        for i in range(count):
            if i not in skip:
                counts = round(26_214.4 * math.sin(2 * math.pi * i / 1_000))
                self.log.position("axis1", START + period * i, i, counts, speed=0.5)

    def test_axes_units_and_legend(self):
        self.turning()
        texts = self.texts(self.svg("POSITION/axis1:value", "POSITION/axis1:speed_rad_s"))
        self.assertEqual(texts[0], "machine.log")
        for expected in ("mm", "rad/s", "POSITION/axis1:value", "POSITION/axis1:speed_rad_s", "-1.0", "-0.5", "0.0", "1.0",
                         "16:00:00.0", "16:00:00.5", "UTC, 2025-11-21"):
            self.assertIn(expected, texts)

    def test_the_curve_is_where_the_readings_are(self):
        self.turning()
        (curve,) = self.curves(self.svg("POSITION/axis1:value"))
        self.assertEqual((curve[0][0], curve[-1][0]), (100.0, 980.0))
        ys = [y for _, y in curve]
        self.assertAlmostEqual(max(ys) - min(ys), 220, delta=1)  # from -1.0 to 1.0
        self.assertLess(len(curve), 4 * 880 + 1)

    def test_gaps_are_gaps(self):
        self.turning(skip=range(500, 700))
        first, second = self.curves(self.svg("POSITION/axis1:value"))
        self.assertAlmostEqual(first[-1][0], 100 + 880 * 499 / 1_999, delta=0.1)
        self.assertAlmostEqual(second[0][0], 100 + 880 * 700 / 1_999, delta=0.1)

    def test_readings_that_are_not_valid_are_not_drawn(self):
        for i in range(10):
            self.log.position("axis1", START + 1_000_000 * i, i, 1_000_000 if i == 5 else i, flags=0 if i == 5 else VALID)
        svg = self.svg("POSITION/axis1:counts")
        self.assertEqual([len(curve) for curve in self.curves(svg)], [5, 4])
        self.assertNotIn("1000000", self.texts(svg))

    def test_lists_and_blocks(self):
        motor = self.log.message("motor_health_t", START, 0, accel_mps2=[1.0, 2.0, 3.0])
        self.log.add(START, "MOTOR/gm1", motor)
        block = self.log.message("position_block_t", START, 0, n=3, dt_ns=[0, 50_000, 100_000], counts=[5, 6, 9],
                                 flags=[1, 1, 1], time_uncertainty_ns=[0, 0, 0])
        self.log.add(START + 200, "POSITION_BLOCK/axis1", block)
        svg = self.svg("MOTOR/gm1:accel_mps2[1]", "POSITION_BLOCK/axis1:counts")
        self.assertEqual([len(curve) for curve in self.curves(svg)], [1, 3])
        self.assertIn("m/s²", self.texts(svg))

    def test_names_that_do_not_exist(self):
        self.turning(10)
        self.assertIn("POSITION/axis1", self.svg("POSITION/axis2:value", exit_code=1))
        self.assertIn("speed_rad_s", self.svg("POSITION/axis1:valu", exit_code=1))
        self.svg("POSITION/axis1", exit_code=2)
        self.assertFalse((self.folder / "out.svg").exists())

    def test_png(self):
        self.turning()
        out = self.folder / "out.png"
        self.axlecast("plot", "--field", "POSITION/axis1:value", "-o", out)
        self.assertEqual(peer("identify", "-format", "%m %w", out), "PNG 1000")
        colours = peer("convert", out, "-define", "histogram:unique-colors=true", "-format", "%c", "histogram:info:-")
        self.assertIn("#0072B2", colours.upper())


if __name__ == "__main__":
    unittest.main()
