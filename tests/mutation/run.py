#!/usr/bin/env python3
"""Mutation check of the numerical core: does a test fail when a formula is changed?

  tests/mutation/run.py BUILD_DIR [--files REGEX] [--scale F] [--jobs N] [--lock FILE] [--list]

One change at a time (a sign, a factor, an index, a comparison, an end of a range) is made to a copy of a source, which is compiled
and linked with the tests of BUILD_DIR (preset dev, built) in place of the original; then the tests that PLAN names for it run, in
their order, until one fails. The source as it is goes the same way first, and must pass. Which changes are made does not depend on
chance: of all there are in a file, as many as PLAN says, evenly spread. --scale takes more or fewer of them. What no test notices is
printed, with the reason from equivalent.txt if it is known to change nothing that matters; the exit code is 1 if there is another.
Nothing in BUILD_DIR or the sources is changed.
"""
import argparse
import concurrent.futures
import contextlib
import fcntl
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))

# Source, how many mutants, and the tests that are to notice, the quick ones first.
FLOAT = 'HollowFloat.A*:VerifyFloat.*:FloatState.*:Physics.*'
SPIN = 'VerifySpin.*:SpinStateOf.*:Physics.*'
STAND = 'VerifyStand.*:StandStateOf.*:HollowStand.*'
PLAN = [
    ('src/physics/moments.cpp', 8, ['MeshMoments.*:MassProperties.*:Monomials.*:MomentMap.*', 'MomentsTwin.*:Quadric.*']),
    ('src/physics/infill.cpp', 5, ['Infill.*']),
    ('src/physics/bead.cpp', 10, ['Bead.*', 'Printed.*']),
    ('src/physics/clipped_hull.cpp', 9, ['Hydrostatics.*:WaterlineForVolume.*:FloatingRest.*:Pockets.*:HydrostaticsTwin.*', FLOAT]),
    ('src/physics/hydrostatics.cpp', 5, ['Hydrostatics.*:WaterlineForVolume.*:OuterHull.*:Pockets.*:HydrostaticsTwin.*', FLOAT]),
    ('src/physics/floating_rest.cpp', 5, ['FloatingRest.*:Hydrostatics.*:FloatState.*', FLOAT]),
    ('src/physics/spin.cpp', 9, ['StableSpeeds.*:OffBalanceTilt.*:SpinState.*:Rpm.*', SPIN]),
    ('src/physics/support_polygon.cpp', 7, ['SupportPolygon.*:SafestPoint.*:TiltingPlane.*', STAND]),
    ('src/solve/goals.cpp', 10, ['FloatGoal.*:SpinGoal.*:StandGoal.*:MappedGoal.*:TargetGoal.*:Inertial.*', 'HollowTarget/Order.*:SolveTarget.*']),
    ('src/solve/quadric.cpp', 9, ['Quadric.*:Scarce.*:*NearestAttainable.*:*Optimality.*', '*RandomProblems.*:*TwelveShapes.*:SolveTarget.*:Certify.*']),
    ('src/solve/certify.cpp', 6, ['Certify.*:*CertifyRandom.*', 'HollowSpin.*']),
    ('src/mesh/surface_gap.cpp', 5, ['SurfaceGap.*', 'Cavity.*:OuterDeviation.*']),
    ('src/rays/ray_integrals.cpp', 7, ['RayIntegrals.*:Scarce.*:*OfQuadrics.*:RayRep.*', 'Quadric.*']),
    ('src/rays/ray_interior.cpp', 6, ['BottomFilledRays.*:SegmentRays.*:InteriorNlp.*:SegmentMoments.*', '*FloatOnRays.*:Ipopt.*']),
    ('src/make/waterline.cpp', 5, ['Waterline.*', 'HollowFloat.*']),
    ('src/make/spin.cpp', 4, [SPIN, 'HollowSpin.*']),
    ('src/make/spin_search.cpp', 5, [SPIN, 'HollowSpin.*']),
    ('src/make/cavity.cpp', 5, ['Cavity.*', 'HollowFloat.*:Core.*']),
    ('src/make/core_maker.cpp', 3, ['Core.*']),
    ('src/make/balls.cpp', 6, ['Balls.*']),
    ('src/judge/inserts.cpp', 3, ['Inserts.*:Core.*']),
    ('src/judge/verify_spin.cpp', 5, [SPIN, 'HollowSpin.*']),
    ('src/judge/verify.cpp', 5, [FLOAT, SPIN + ':' + STAND]),
    ('src/judge/verify_stand.cpp', 4, [STAND]),
]
LIMIT_S = 300  # for each filter; none takes a tenth of it on a machine that does nothing else
LIMIT_BYTES = 8 << 30

NEXT = {'M1': 'MZ', 'MX': 'MY', 'MY': 'MX', 'MZ': 'MX', 'MXX': 'MYY', 'MYY': 'MZZ', 'MZZ': 'MXX', 'MXY': 'MYZ', 'MYZ': 'MXZ', 'MXZ': 'MXY'}
OPERATORS = [
    (r' \+ ', lambda m: ' - '),
    (r' - ', lambda m: ' + '),
    (r' \+= ', lambda m: ' -= '),
    (r' -= ', lambda m: ' += '),
    (r' < ', lambda m: ' > '),
    (r' > ', lambda m: ' < '),
    (r' <= ', lambda m: ' > '),
    (r' >= ', lambda m: ' < '),
    (r' && ', lambda m: ' || '),
    (r' \|\| ', lambda m: ' && '),
    (r'(?<=[(=,] )-(?=[a-z(])|(?<=\()-(?=[a-z(])|(?<=return )-(?=[a-z(])', lambda m: ''),
    (r'(?<=/ )\d+\b(?!\.)|(?<![-.\w])\d+(?= \* )|\b0\.5(?= \* )', lambda m: str(float(m[0]) * 1.5) if '.' in m[0] else str(int(m[0]) + 1)),
    (r'\bM(1|X|Y|Z|XX|YY|ZZ|XY|YZ|XZ)\b', lambda m: NEXT[m[0]]),
    (r'\.x\(\)', lambda m: '.y()'),
    (r'\.y\(\)', lambda m: '.x()'),
    (r'\.z\(\)', lambda m: '.x()'),
    (r'\[0\]', lambda m: '[1]'),
    (r'\[1\]', lambda m: '[0]'),
    (r'\[2\]', lambda m: '[1]'),
    (r'std::min\b(?=\()', lambda m: 'std::max'),
    (r'std::max\b(?=\()', lambda m: 'std::min'),
    (r'std::sin\b', lambda m: 'std::cos'),
    (r'std::cos\b', lambda m: 'std::sin'),
    (r'\.transpose\(\)(?= \*)', lambda m: ''),
]
# Words, tolerances, and loops whose change runs for ever or out of bounds, are not formulas.
NO_FORMULA = re.compile(r'^\s*(//|#|template|using|class|struct|enum|static_assert|assert|throw|case |default:|for |while |\}|\{$)|'
                        r'"|\bconstexpr\b|\bconst double k[A-Z]|Error\(|concat\(|number\(|progress|reserve\(|evaluations')


def candidates(source):
    """(line number, operator's place, new line) of every change there is."""
    found = []
    for n, line in enumerate(source):
        code = line.split('  // ')[0].split('///')[0]
        if NO_FORMULA.search(code):
            continue
        for pattern, change in OPERATORS:
            for m in re.finditer(pattern, code):
                found.append((n, m.start(), line[:m.start()] + change(m) + line[m.end():]))
    return sorted(found)


def spread(found, count):
    """`count` of them, evenly spread, each followed by its neighbours to fall back on."""
    count = min(count, len(found))
    return [[found[(i * len(found) // count + k) % len(found)] for k in range(min(6, len(found)))] for i in range(count)]


class Builder:
    def __init__(self, build, work):
        self.build, self.work = build, work
        lines = subprocess.run(['ninja', '-C', build, '-t', 'commands', 'rayrep_tests'], capture_output=True, text=True, check=True).stdout.splitlines()
        self.compile = {}
        for line in lines:
            m = re.search(r' -c (\S+\.cpp)$', line)
            if m:
                self.compile[os.path.relpath(m[1], ROOT)] = line
        link = [line for line in lines if re.search(r' -o rayrep_tests ', line)][-1]
        # A copy of what is linked, so that BUILD_DIR may be built meanwhile; mutants come before the library's archive.
        for name in set(re.findall(r'\S+\.(?:o|a)\b', link)):
            copy = os.path.join(work, name.replace('/', '_'))
            source = os.path.join(build, name)
            if os.path.exists(source) and not os.path.isabs(name):
                shutil.copy(source, copy)
                link = re.sub(r'(?<=\s)' + re.escape(name) + r'(?=\s|$)', copy, link)
        objects = re.findall(r'\S+\.o\b', link)
        whole = os.path.join(work, 'tests.o')
        subprocess.run(['ld', '-r', '-S', '-o', whole] + objects, check=True)
        for name in objects:
            link = link.replace(name + ' ', '')
            os.remove(name)
        link = re.sub(r' -o rayrep_tests ', f' -s -o {work}/NAME {whole} {work}/NAME.o ', link)
        if shutil.which('ld.lld'):
            link = link.replace(' -o ', ' -fuse-ld=lld -o ', 1)
        link = re.sub(r'&& cd .*', '', link)
        self.link = link.split('&& ', 1)[1] if link.startswith(': && ') else link
        self.link = re.sub(r'&&\s*:?\s*$', '', self.link.replace('&& :', ''))

    def compiles(self, source, text, name):
        """Makes NAME.o of a changed source, as the build does but quicker; False if it is none."""
        copy = os.path.join(self.work, name + '.cpp')
        with open(copy, 'w') as file:
            file.write(text)
        command = re.sub(r'^\S*ccache ', '', self.compile[source])
        command = re.sub(r' -MD -MT \S+ -MF \S+', '', command)
        command = re.sub(r' -o \S+ -c \S+$', f' -o {self.work}/{name}.o -c {copy}', command)
        command = command.replace(' -Werror', '').replace(' -O2 ', ' -O1 ').replace(' -g1 ', ' ')
        return subprocess.run(command, shell=True, cwd=self.build, capture_output=True).returncode == 0

    def links(self, name):
        done = subprocess.run(self.link.replace('NAME', name), shell=True, cwd=self.build, capture_output=True, text=True)
        if done.returncode != 0:
            print(done.stderr, file=sys.stderr)
        os.remove(os.path.join(self.work, name + '.o'))
        return done.returncode == 0

    def killer(self, name, filters):
        """The first test that fails, 'time' where one takes for ever, or None."""
        env = dict(os.environ, GTEST_FAIL_FAST='1', GTEST_BRIEF='1')
        limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))
        for which in filters:
            try:
                run = subprocess.run([os.path.join(self.work, name), f'--gtest_filter={which}'], cwd=self.build, env=env, preexec_fn=limit,
                                     capture_output=True, text=True, errors='replace', timeout=LIMIT_S)
            except subprocess.TimeoutExpired:
                return 'time'
            if run.returncode != 0:
                m = re.search(r'\[  FAILED  \] (\S+?)[, ]', run.stdout + ' ')
                return m[1] if m else f'exit {run.returncode}'
        return None


@contextlib.contextmanager
def locked(path):
    if not path:
        yield
        return
    with open(path, 'w') as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def known_equivalent():
    """{(source, new line): why}"""
    known = {}
    with open(os.path.join(HERE, 'equivalent.txt')) as file:
        for line in file:
            if line.strip() and not line.startswith('#'):
                source, new, why = (part.strip() for part in line.split(' ## '))
                known[source, new] = why
    return known


class Check:
    """The mutants of one source."""

    def __init__(self, builder, row, scale):
        self.builder, (self.source, count, self.filters) = builder, row
        with open(os.path.join(ROOT, self.source)) as file:
            self.text = file.readlines()
        self.wanted = spread(candidates(self.text), max(1, round(count * scale)))
        self.stem = re.sub(r'\W', '_', self.source)

    def words(self, change):
        return f'{self.source}:{change[0] + 1}: {self.text[change[0]].strip()}  =>  {change[1].strip()}'

    def first_that_compiles(self, number):
        """Of the changes in place `number`; the text as it is for -1. @returns (binary, change), or None."""
        name = f'{self.stem}_{number + 1}'
        for n, _, new in self.wanted[number] if number >= 0 else [(0, 0, self.text[0])]:
            if self.builder.compiles(self.source, ''.join(self.text[:n] + [new] + self.text[n + 1:]), name):
                return (name, (n, new)) if self.builder.links(name) else None
        return None

    def build(self, jobs):
        with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
            return list(pool.map(self.first_that_compiles, range(-1, len(self.wanted))))

    def run(self, made, known):
        """@returns how many mutants there were, were killed, are equivalent; None if the source as it is fails."""
        counts = [0, 0, 0]
        for number, binary in enumerate(made):
            if not binary:
                print(f'none compiles in place {number} of {self.source}', flush=True)
                continue
            begin = time.time()
            killer = self.builder.killer(binary[0], self.filters)
            os.remove(os.path.join(self.builder.work, binary[0]))
            took = f'{time.time() - begin:.0f} s'
            if number == 0:
                print(f'as it is  {self.source}  [{"FAILS " + killer if killer else "passes"}, {took}]', flush=True)
                if killer:
                    return None
                continue
            counts[0] += 1
            why = known.get((self.source, binary[1][1].strip()))
            if killer:
                counts[1] += 1
                print(f'killed    {self.words(binary[1])}  [{killer}, {took}]', flush=True)
            elif why:
                counts[2] += 1
                print(f'same      {self.words(binary[1])}  [{why}]', flush=True)
            else:
                print(f'SURVIVES  {self.words(binary[1])}  [{took}]', flush=True)
        return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('build')
    parser.add_argument('--files', default='', help='sources whose name matches')
    parser.add_argument('--scale', type=float, default=1, help='times as many mutants')
    parser.add_argument('--lock', help='file to lock while compiling')
    parser.add_argument('--jobs', type=int, default=2, help='compilers at a time')
    parser.add_argument('--list', action='store_true', help='the mutants, without running them')
    options = parser.parse_args()
    known = known_equivalent()
    plan = [row for row in PLAN if re.search(options.files, row[0])]
    if options.list:
        for check in (Check(None, row, options.scale) for row in plan):
            for choices in check.wanted:
                print(check.words((choices[0][0], choices[0][2])))
        return 0

    table, failing = {}, False
    with tempfile.TemporaryDirectory() as work:
        builder = Builder(os.path.abspath(options.build), work)

        def build(row):
            check = Check(builder, row, options.scale)
            with locked(options.lock):
                return check, check.build(options.jobs)

        # The next source is compiled while the tests of one run.
        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            for check, made in pool.map(build, plan):
                counts = check.run(made, known)
                if counts is None:
                    failing = True
                else:
                    table[check.source] = counts
    table['all'] = [sum(row[k] for row in table.values()) for k in range(3)]
    print('\n| source | mutants | killed | equivalent | survive |\n|---|---|---|---|---|')
    for source, (count, killed, equivalent) in table.items():
        print(f'| {source} | {count} | {killed} | {equivalent} | {count - killed - equivalent} |')
    count, killed, equivalent = table['all']
    return 1 if failing or killed + equivalent < count else 0


if __name__ == '__main__':
    sys.exit(main())
