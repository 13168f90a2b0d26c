#include "rayrep/motion/motion_check.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <numeric>
#include <string>
#include <utility>

#include "base/text.h"
#include "motion/pair_timeline.h"
#include "motion/solid_body.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

using Bodies = std::map<const Mesh*, std::shared_ptr<SolidBody>>;

/// How two parts are told apart from what is allowed to them.
struct Tested {
  std::size_t transition = 0, first = 0, second = 0;
  double clearance_mm = 0;
};

/// Nothing for pairs that may touch.
std::vector<Tested> tested_pairs(const Scene& scene, const MotionCheckOptions& options) {
  std::vector<Tested> all;
  for (std::size_t t = 0; t < scene.transitions.size(); ++t)
    for (std::size_t a = 0; a < scene.parts.size(); ++a)
      for (std::size_t b = a + 1; b < scene.parts.size(); ++b) {
        const auto said = std::find_if(scene.pairs.begin(), scene.pairs.end(), [&](const ScenePair& pair) {
          return std::minmax(pair.first, pair.second) == std::minmax(a, b);
        });
        if (said != scene.pairs.end() && !said->clearance_mm) continue;
        const double usual = options.clearance_mm.value_or(scene.clearance_mm);
        all.push_back({t, a, b, said == scene.pairs.end() ? usual : *said->clearance_mm});
      }
  return all;
}

void add_bytes(std::string& key, const void* data, std::size_t size) { key.append(static_cast<const char*>(data), size); }

void add_bytes(std::string& key, const ScenePart& part, const Motion& motion) {
  const Mesh* mesh = part.mesh.get();
  add_bytes(key, &mesh, sizeof mesh);
  add_bytes(key, part.pivot_mm.data(), 3 * sizeof(double));
  for (const std::size_t count : {motion.translation.size(), motion.rotation.size()}) add_bytes(key, &count, sizeof count);
  for (const TranslationKey& k : motion.translation) {
    add_bytes(key, &k.time, sizeof k.time);
    for (const Eigen::Vector3d* p : {&k.at_mm, &k.in_mm, &k.out_mm}) add_bytes(key, p->data(), 3 * sizeof(double));
  }
  for (const RotationKey& k : motion.rotation) {
    add_bytes(key, &k.time, sizeof k.time);
    add_bytes(key, k.rotation.coeffs().data(), 4 * sizeof(double));
  }
}

/// Everything that the answer for a pair depends on.
std::string key_of(const Scene& scene, const Tested& pair, const MotionCheckOptions& options) {
  std::string key;
  for (const double number : {pair.clearance_mm, options.tolerance, options.touch}) add_bytes(key, &number, sizeof number);
  const std::vector<Motion>& motions = scene.transitions[pair.transition].motions;
  for (const std::size_t part : {pair.first, pair.second}) add_bytes(key, scene.parts[part], motions[part]);
  return key;
}

void require_sensible(const MotionCheckOptions& options) {
  if (!(options.tolerance >= 1e-7 && options.tolerance <= 0.5))
    throw Error(ErrorCode::usage, "The tolerance of a motion check is a share of the transition between 1e-7 and 0.5; it is " +
                                      shown(options.tolerance) + ".");
  if (options.clearance_mm && !(*options.clearance_mm >= 0))
    throw Error(ErrorCode::usage, "The clearance must not be negative; it is " + shown(*options.clearance_mm) + " mm.");
}

}  // namespace

bool PairMotion::overlaps() const {
  return std::any_of(intervals.begin(), intervals.end(),
                     [](const CollisionInterval& i) { return i.kind == CollisionInterval::Kind::overlap; });
}

bool MotionReport::free() const {
  return std::none_of(pairs.begin(), pairs.end(), [](const PairMotion& pair) { return pair.overlaps(); });
}

struct MotionChecker::Kept {
  std::map<const Mesh*, std::shared_ptr<const Mesh>> meshes;
  Bodies bodies;
  std::map<std::string, std::vector<CollisionInterval>> answers;
};

namespace {

/// One check: the pairs whose answer is not known, sharpened together.
class Run {
public:
  Run(const Scene& scene, const MotionCheckOptions& options, const Progress& progress)
      : scene_(scene), options_(options), progress_(progress), tested_(tested_pairs(scene, options)) {
    for (const Tested& pair : tested_) {
      keys_.push_back(key_of(scene, pair, options));
      report_.pairs.push_back({pair.transition, pair.first, pair.second, pair.clearance_mm, {}});
    }
  }

  void take_known(const std::map<std::string, std::vector<CollisionInterval>>& answers) {
    for (std::size_t n = 0; n < tested_.size(); ++n) {
      const auto found = answers.find(keys_[n]);
      if (found == answers.end()) {
        open_.push_back(n);
      } else {
        report_.pairs[n].intervals = found->second;
        ++report_.kept;
      }
    }
  }

  /// Meshes that have to be looked at.
  void prepare(Bodies& bodies) {
    for (const std::size_t n : open_)
      for (const std::size_t part : {tested_[n].first, tested_[n].second}) {
        const auto& mesh = scene_.parts[part].mesh;
        std::shared_ptr<SolidBody>& body = bodies[mesh.get()];
        if (!body) body = std::make_shared<SolidBody>(mesh);
        if (!body->is_prepared()) new_bodies_.push_back(body);
      }
    std::sort(new_bodies_.begin(), new_bodies_.end());
    new_bodies_.erase(std::unique(new_bodies_.begin(), new_bodies_.end()), new_bodies_.end());
    for (const std::size_t n : open_) timelines_.push_back(timeline(tested_[n], bodies));
  }

  void sharpen() {
    tbb::parallel_for(std::size_t{0}, timelines_.size(), [&](std::size_t k) { timelines_[k].by_boxes(1.0 / 32); });
    tell(MotionReport::Stage::coarse);
    tbb::parallel_for(std::size_t{0}, new_bodies_.size(), [&](std::size_t n) { new_bodies_[n]->prepare(); });
    for (double longest = 1.0 / 4; longest > 4 * options_.tolerance; longest /= 4) refine(longest);
    refine(0);
    std::vector<std::pair<const PairTimeline*, CollisionInterval*>> told;
    for (std::size_t k = 0; k < open_.size(); ++k)
      for (CollisionInterval& interval : report_.pairs[open_[k]].intervals) told.emplace_back(&timelines_[k], &interval);
    constexpr std::size_t kAtOnce = 8;
    for (std::size_t first = 0; first < told.size(); first += kAtOnce) {
      progress_.check();
      tbb::parallel_for(first, std::min(first + kAtOnce, told.size()),
                        [&](std::size_t n) { told[n].first->describe(*told[n].second); });
    }
    report_.stage = MotionReport::Stage::complete;
    if (options_.found) options_.found(report_);
  }

  std::map<std::string, std::vector<CollisionInterval>> answers() const {
    std::map<std::string, std::vector<CollisionInterval>> all;
    for (std::size_t n = 0; n < keys_.size(); ++n) all[keys_[n]] = report_.pairs[n].intervals;
    return all;
  }
  const MotionReport& report() const { return report_; }

private:
  PairTimeline timeline(const Tested& pair, const Bodies& bodies) const {
    const std::vector<Motion>& motions = scene_.transitions[pair.transition].motions;
    const auto moving = [&](std::size_t part) {
      const ScenePart& p = scene_.parts[part];
      return MovingBody{bodies.at(p.mesh.get()).get(), &motions[part], p.pivot_mm};
    };
    const MovingBody first = moving(pair.first), second = moving(pair.second);
    const double touch = options_.touch * std::min(first.body->diagonal_mm(), second.body->diagonal_mm());
    return {first, second, {pair.clearance_mm, options_.tolerance, touch}};
  }

  void refine(double longest) {
    constexpr int kMoments = 16;  // of each pair, before it is asked whether to go on
    std::vector<std::size_t> left(timelines_.size());
    std::iota(left.begin(), left.end(), 0);
    while (!left.empty()) {
      progress_.check();
      tbb::parallel_for(std::size_t{0}, left.size(), [&](std::size_t n) { timelines_[left[n]].refine(longest, kMoments); });
      std::erase_if(left, [&](std::size_t k) { return !timelines_[k].is_undecided(longest); });
    }
    tell(MotionReport::Stage::when);
  }

  void tell(MotionReport::Stage stage) {
    report_.stage = stage;
    report_.moments = 0;
    for (std::size_t k = 0; k < open_.size(); ++k) {
      report_.pairs[open_[k]].intervals = timelines_[k].intervals();
      report_.moments += timelines_[k].moments();
    }
    if (options_.found) options_.found(report_);
  }

  const Scene& scene_;
  const MotionCheckOptions& options_;
  const Progress& progress_;
  std::vector<Tested> tested_;
  std::vector<std::string> keys_;
  std::vector<std::size_t> open_;  ///< of tested_
  std::vector<std::shared_ptr<SolidBody>> new_bodies_;
  std::vector<PairTimeline> timelines_;
  MotionReport report_;
};

}  // namespace

MotionChecker::MotionChecker() : kept_(std::make_unique<Kept>()) {}
MotionChecker::~MotionChecker() = default;
MotionChecker::MotionChecker(MotionChecker&&) noexcept = default;
MotionChecker& MotionChecker::operator=(MotionChecker&&) noexcept = default;

MotionReport MotionChecker::check(const Scene& scene, const MotionCheckOptions& options, const Progress& progress) {
  require_sensible(options);
  Run run(scene, options, progress);
  run.take_known(kept_->answers);
  run.prepare(kept_->bodies);
  run.sharpen();
  kept_->answers = run.answers();
  // What the answers speak of stays, so that no other mesh comes to lie where it was.
  std::map<const Mesh*, std::shared_ptr<const Mesh>> meshes;
  for (const ScenePart& part : scene.parts) meshes[part.mesh.get()] = part.mesh;
  std::erase_if(kept_->bodies, [&](const auto& body) { return !meshes.contains(body.first); });
  kept_->meshes = std::move(meshes);
  return run.report();
}

}  // namespace rayrep
