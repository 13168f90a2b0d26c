// Random scenes against samples of what is known of their bodies: motion_sampling FIRST COUNT [SAMPLES]. Not in CI; a few of them
// are a test (MotionCheck.RandomScenesMissNothingThatSamplesFind).

#include <cstdio>
#include <cstdlib>

#include "motion_scenes.h"

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: motion_sampling FIRST COUNT [SAMPLES]\n");
    return 2;
  }
  const auto first = static_cast<unsigned>(std::atoi(argv[1])), count = static_cast<unsigned>(std::atoi(argv[2]));
  const int samples = argc > 3 ? std::atoi(argv[3]) : 10000;
  std::size_t overlapping = 0, intervals = 0, wrong = 0;
  for (unsigned seed = first; seed < first + count; ++seed) {
    const rayrep::test::SampledScene found = rayrep::test::sample_scene(seed, samples, 1e-3);
    overlapping += found.overlapping;
    intervals += found.intervals;
    wrong += !found.wrong.empty();
    std::fputs(found.wrong.c_str(), stdout);
  }
  std::printf("%u scenes: %zu intervals, %zu samples overlap, %zu scenes are wrong\n", count, intervals, overlapping, wrong);
  return wrong > 0;
}
