"""The cases of tests/time_guests/run: what is done to the guests, and what must hold beside the truth of every interval."""

import shlex

import chrony as chronyd
from guests import OTHER, ROOT, Trouble


def same(name, before, after):
    if before[name] != after[name]:
        raise Trouble(f"{name} changed from {before[name]} to {after[name]}")


def other(name, before, after):
    if before[name] == after[name]:
        raise Trouble(f"{name} is still {after[name]}")


def plain(run, count):
    run.phase("plain")
    run.measure(count)


def begin_with_delay(run, name, seconds):
    """More delay in one direction before the first exchange of b: the truth is near the edge of every interval."""
    run.b.kill_time()
    run.link.delay[name] = seconds
    mark = run.mark()
    run.b.start_time()
    run.synchronised(mark)


def tick(run, count):
    """Two axes on each guest, read on common ticks, and joined to sets in guest a. The true instants of sampling follow from the shafts."""
    run.phase("one tick over four axes")
    started = [(guest, guest.start_axes()) for guest in (run.a, run.b)]
    started.append((run.a, [run.a.start_program("axlecast", "sets", "/run/vm/machine.yaml")]))
    run.measure_sets(count // 2)
    run.phase("one tick over four axes, 10 ms more delay for what b sends, from the first exchange on")
    begin_with_delay(run, OTHER, 0.01)
    run.measure_sets(count // 2)
    run.link.delay[OTHER] = 0.0
    for guest, numbers in started:
        guest(f"kill -9 {' '.join(map(str, numbers))}")


def utc_steps(run, count):
    """UNIX time of b is 3 s ahead, is stepped back, and so on. Nothing may change."""
    run.phase("UNIX time of b stepped by 3 s, forth and back")
    before, mark = run.states()[-1], run.mark()
    for step in (3, -3, 3, -3):
        run.b(f"date -s @$(($(date +%s) + {step}))")
        run.measure(count // 4)
    for after in run.states(mark):  # a host that is starved may miss answers
        same("base_id", before, after)
        same("epoch", before, after)


def slew(guest, ppm):
    """The rate of CLOCK_MONOTONIC against CLOCK_MONOTONIC_RAW: frequency up to 500 ppm, and the tick of 10,000 us for more."""
    tick = round(ppm / 100) if abs(ppm) > 500 else 0
    guest(f"busybox adjtimex -q -t {10000 + tick} -f {round((ppm - 100 * tick) * 65536)}")


def drift(run, count):
    for name, ppm in ((OTHER, 200), (OTHER, -500), (ROOT, 200)):
        run.phase(f"CLOCK_MONOTONIC of {name} slewed by {ppm} ppm")
        guest = run.b if name == OTHER else run.a
        slew(guest, ppm)
        run.measure(count // 3)
        slew(guest, 0)


def beyond_slew(run, _count):
    """5,000 ppm where the machine file has a limit of 1,000: the claim ends, and a new epoch begins."""
    run.phase("CLOCK_MONOTONIC of b slewed by 5,000 ppm, beyond max_slew_ppm")
    before = run.states()[-1]
    run.event("beyond")
    lost, after = run.withdrawn(lambda: slew(run.b, 5000), lambda: slew(run.b, 0), least=30)
    run.event("within")
    if "max_slew_ppm" not in lost["reason"]:
        raise Trouble(f"lost for another reason: {lost['reason']}")
    same("base_id", before, after)
    other("epoch", before, after)


def slow_from_the_start(run, count):
    for name in (ROOT, OTHER):
        run.phase(f"20 ms more delay for what {name} sends, from the start")
        begin_with_delay(run, name, 0.02)
        run.measure(count)
        run.link.delay[name] = 0.0


def asymmetry(run, count):
    for name in (ROOT, OTHER):
        run.phase(f"2 ms more delay for what {name} sends")
        run.link.delay[name] = 0.002
        run.measure(count // 2)
        run.link.delay[name] = 0.0
    slow_from_the_start(run, count // 6)


def cut(run, count):
    for _ in range(max(1, count // 60)):
        run.phase("the link is cut and restored")
        before = run.states()[-1]
        lost, after = run.withdrawn(run.link.cut, run.link.restore)
        if "no answer of the root" not in lost["reason"]:
            raise Trouble(f"lost for another reason: {lost['reason']}")
        same("base_id", before, after)
        same("epoch", before, after)
        run.measure(20)


def root_process(run, _count):
    """The clock of the root outlives its process: base and epoch remain."""
    run.phase("the root's process is killed and started again")
    before = run.states()[-1]
    _, after = run.withdrawn(run.a.kill_time, run.a.start_time)
    same("base_id", before, after)
    same("epoch", before, after)
    run.measure(30)


def other_process(run, _count):
    run.phase("the process of b is killed and started again")
    before, mark = run.states()[-1], run.mark()
    run.b.kill_time()
    run.b.start_time()
    after = run.synchronised(mark)
    same("base_id", before, after)
    other("boot_id", before, after)
    run.measure(30)


def boot_again(run, guest):
    """Ends a guest and boots it; its claims, or those that rest on it, end with it."""
    guest.pin()
    guest.end()
    run.event("withdraw")
    new = run.make(guest.name)
    new.wait_ready()
    new.pin()
    run.event("resume")
    new.start_time()
    return new


def root_guest(run, _count):
    """Another boot of the root is another clock."""
    run.phase("the root guest is killed and boots again")
    before, mark = run.states()[-1], run.mark()
    run.a = boot_again(run, run.a)
    lost = run.lost(mark)
    after = run.synchronised(mark + run.states(mark).index(lost))
    other("base_id", before, after)
    other("epoch", before, after)
    run.measure(60)


def rates(run, count):
    """Up to 100 ppm between CLOCK_MONOTONIC_RAW of two hosts are allowed for. Beyond the limit, an exchange contradicts the earlier
    ones after some seconds; until then, claims may miss the truth."""
    def boot(ppm):
        run.phase("b boots again")
        run.ppm[OTHER] = ppm
        run.b = boot_again(run, run.b)
        run.synchronised(0)

    boot(400)
    run.phase("CLOCK_MONOTONIC_RAW of b is 400 ppm faster, beyond max_rate_ppm")
    run.event("beyond")
    lost = run.lost(0)
    if "max_rate_ppm" not in lost["reason"]:
        raise Trouble(f"lost for another reason: {lost['reason']}")
    run.measure(count // 3)
    print(f"  contradictions: {sum('max_rate_ppm' in each['reason'] for each in run.states())}", flush=True)
    boot(90)
    run.event("within")
    for ppm in (90, -90):
        if run.ppm[OTHER] != ppm:
            boot(ppm)
        run.phase(f"CLOCK_MONOTONIC_RAW of b is {abs(ppm)} ppm {'faster' if ppm > 0 else 'slower'}")
        run.measure(count // 3)


def chrony(run, count):
    """What chronyd claims of UNIX time, beside what we claim of the base: figures only. chronyd believes its server."""
    chronyd.start(run)
    run.phase("chronyd: settles")
    run.measure(100)
    run.phase("chronyd: b follows a")
    run.measure(count)
    run.phase("chronyd: 2 ms more delay for what a sends")
    run.link.delay[ROOT] = 0.002
    run.measure(count)
    run.link.delay[ROOT] = 0.0
    run.measure(50)
    run.phase("chronyd: UNIX time of a, its server, is stepped by 5 ms")
    run.a(f"/usr/bin/python3 -c {shlex.quote(chronyd.STEP)}")
    run.measure(count // 3)


def short(run, _count):
    """What tools/test runs: the cases that most mistakes would fail in."""
    slow_from_the_start(run, 30)
    run.phase("plain, and UNIX time of b stepped by 3 s")
    run.b("date -s @$(($(date +%s) + 3))")
    run.measure(40)
    cut(run, 1)


CASES = {function.__name__: function for function in
         (plain, tick, utc_steps, drift, asymmetry, cut, beyond_slew, root_process, other_process, root_guest, chrony, rates, short)}
ALL = [name for name in CASES if name != "short"]
