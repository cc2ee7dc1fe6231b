#!/usr/bin/env python3
"""Draws docs/images/wiring-*.svg, the circuit around the reference board: `pip install schemdraw`, then run this file."""

import pathlib

import schemdraw
from schemdraw import elements as elm

schemdraw.config(fontsize=11, font="sans-serif", lw=1.4)
schemdraw.use("svg")
FOLDER = pathlib.Path(__file__).parent


def drawing(name):
    d = schemdraw.Drawing(file=str(FOLDER / f"wiring-{name}.svg"), show=False)
    d.config(bgcolor="white", margin=0.3)
    return d


def chip(d, at, title, left, right, width, pitch=1.0):
    """A box at its lower left corner; pins from the top, none where the name is empty."""
    rows = max(len(left), len(right))
    def pins(names, side):
        return [
            elm.IcPin(name=name, side=side, slot=f"{rows - index}/{rows}", anchorname=f"{side[0]}{index}")
            for index, name in enumerate(names)
            if name
        ]
    box = elm.Ic(pins=pins(left, "left") + pins(right, "right"), size=(width, rows * pitch), leadlen=0.4)
    d += (box := box.right().at(at).anchor("center").label(title, loc="top", ofst=0.15))
    return box


def wire(d, start, end, shape="-|-"):
    d += elm.Wire(shape, k=None).at(start).to(end) if shape != "-" else elm.Line().at(start).to(end)


def text(d, at, words, **options):
    d += elm.Label().at(at).label(words, **options)


def encoder():
    with drawing("encoder") as d:
        plug = chip(d, (0, 0), "encoder x, RS-422", [], ["A+", "A−", "B+", "B−", "I+", "I−", "5 V", "0 V"], 2.2)
        receiver = chip(d, (7, 0), "AM26LV32", ["1A", "1B", "2A", "2B", "3A", "3B", "VCC", "GND"], ["1Y", "", "2Y", "", "3Y"], 2.6)
        board = chip(d, (12.5, 0), "Nucleo-F446RE", ["PB8", "", "PB9", "", "PB10", "", "3V3", "GND"], [], 2.2)
        for pair in range(3):
            for line in (2 * pair, 2 * pair + 1):
                wire(d, getattr(plug, f"r{line}"), getattr(receiver, f"l{line}"), "-")
            top, bottom = getattr(plug, f"r{2 * pair}"), getattr(plug, f"r{2 * pair + 1}")
            x = top[0] + 1.6 
            d += elm.Resistor().at((x, top[1])).to((x, bottom[1])).scale(0.5).label("120 Ω", loc="bottom", fontsize=9)
            wire(d, getattr(receiver, f"r{2 * pair}"), getattr(board, f"l{2 * pair}"), "-")
        wire(d, plug.r7, receiver.l7, "-")
        d += elm.Line().at(plug.r6).right(0.6)
        d += elm.Vdd().label("5 V, external")
        supply = receiver.l6
        d += elm.Line().at(supply).left(0.5)
        d += elm.Vdd().label("3.3 V of the board", fontsize=9)
        d += elm.Line().at(board.l6).left(0.5)
        d += elm.Vdd().label("3.3 V", fontsize=9)
        d += elm.Line().at(board.l7).left(0.5)
        d += elm.Ground()
        d += elm.Line().at(receiver.l7).left(0.5)
        d += elm.Ground()


def outputs():
    with drawing("outputs") as d:
        board = chip(d, (0, 0), "Nucleo-F446RE", [], ["PB13", "PB15", "PB14", "PB12", "PB1", "PB2", "3V3", "GND"], 2.2)
        converter = chip(
            d, (7.5, 0), "AD5754R", ["SCLK", "SDIN", "SDO", "/SYNC", "/LDAC", "/CLR", "DVCC", "GND"],
            ["VOUTA", "VOUTB", "VOUTC", "BIN//2sCOMP", "REFOUT", "REFIN", "AVDD", "AVSS"], 4.2)
        amplifier = chip(d, (14, 2.5), "amplifiers", ["x command, ±10 V", "y command", "z command"], [], 4.2)
        for row in range(8):
            wire(d, getattr(board, f"r{row}"), getattr(converter, f"l{row}"), "-")
        clear = (board.r5[0] + 1.6, board.r5[1])
        ground = board.r7
        d += elm.Dot().at(clear)
        d += elm.Line().at(clear).to((clear[0], ground[1] - 0.6))
        d += elm.Resistor().down().at((clear[0], ground[1] - 0.6)).length(1.6).label("10 kΩ", loc="bottom", fontsize=9)
        d += elm.Ground()
        d += elm.Line().at((ground[0] + 0.5, ground[1])).down(0.6)
        d += elm.Ground()
        for row in range(3):
            wire(d, getattr(converter, f"r{row}"), getattr(amplifier, f"l{row}"), "-")
        d += elm.Line().at(converter.r3).right(0.8)
        d += elm.Ground()
        d += elm.Line().at(converter.r4).right(0.5)
        d += elm.Line().to((converter.r5[0] + 0.5, converter.r5[1]))
        d += elm.Line().to(converter.r5)
        d += elm.Line().at(converter.r6).right(0.8)
        d += elm.Vdd().label("+15 V", loc="right")
        d += elm.Line().at(converter.r7).right(0.8)
        d += elm.Vss().label("−15 V", loc="right")


def safety():
    with drawing("safety") as d:
        board = chip(
            d, (14.2, -4), "Nucleo-F446RE",
            ["PA0", "", "PC0 (others: table)", "", "", "PC9", "", "PB5", "GND"], [], 4.4, 1.2)
        # The first contact of the emergency stop acts by itself.
        d += elm.Vdd().at((-3, 4)).label("24 V", loc="left", ofst=0.3)
        d += elm.Line().at((-3, 4)).right(1)
        d += elm.Switch(nc=True).right().length(2).label("emergency stop, contact 1", fontsize=9, ofst=0.35)
        d += elm.Line().right(2.6)
        relay = elm.Ic(
            pins=[elm.IcPin(name="coil", side="left", anchorname="coil"), elm.IcPin(name="contacts", side="right", anchorname="contacts")],
            size=(3.2, 1.2), leadlen=0.3).right().anchor("coil").label("safety relay", loc="top")
        d += relay
        d += elm.Arrow().at(relay.contacts).right(2).label("amplifiers: power, or safe torque off", loc="right")
        # Contacts that light an optocoupler.
        for y, words, pin in ((0.9, "emergency stop, contact 2", board.l0), (-2.2, "limit, home, amplifier fault", board.l2)):
            d += elm.Vdd().at((-3, y)).label("24 V", loc="left", ofst=0.3)
            d += elm.Line().at((-3, y)).right(1)
            d += elm.Switch(nc=True).right().length(2).label(words, fontsize=9, ofst=0.35)
            d += elm.Line().right(1)
            d += elm.Resistor().right().length(1.6).label("2.2 kΩ", fontsize=9)
            opto = elm.Optocoupler().right().anchor("anode")
            d += opto
            d += elm.Line().at(opto.cathode).left(0.4)
            d += elm.Ground().label("0 V", loc="left", fontsize=9)
            d += elm.Line().at(opto.emitter).right(0.4)
            d += elm.Ground()
            d += elm.Line().at(opto.collector).right(0.6)
            d += elm.Resistor().right().length(1.6).label("100 Ω", fontsize=9)
            node = d.here
            d += elm.Dot()
            d += elm.Capacitor().down().length(1.2).label("100 nF", loc="bottom", fontsize=9)
            d += elm.Ground()
            wire(d, node, pin, "-|")
        # Outputs that a pull-down keeps off.
        for pin, words in ((board.l5, "AND safety relay: amplifier enable"), (board.l7, "relay or transistor: holding brake")):
            d += elm.Line().at(pin).left(2)
            node = d.here
            d += elm.Dot()
            d += elm.Resistor().down().length(1.1).label("10 kΩ", loc="bottom", fontsize=9)
            d += elm.Ground()
            d += elm.Arrow().at(node).left(2).label(words, loc="left")
        d += elm.Line().at(board.l8).left(0.5)
        d += elm.Ground()


for draw in (encoder, outputs, safety):
    draw()
