#include "latest.h"

namespace rayrep::tool {

Latest::Turn::Turn(Latest& latest, Kind kind) : latest_(latest), kind_(kind) {
  std::unique_lock lock(latest_.mutex_);
  number_ = ++latest_.newest_;
  latest_.changed_.notify_all();
  const auto too_late = [&] { return latest_.ended_ || (kind_ == Kind::looks && latest_.newest_ != number_); };
  latest_.changed_.wait(lock, [&] { return !latest_.taken_ || too_late(); });
  if (too_late()) return;
  has_it_ = latest_.taken_ = true;
}

Latest::Turn::~Turn() {
  if (!has_it_) return;
  const std::lock_guard lock(latest_.mutex_);
  latest_.taken_ = false;
  latest_.changed_.notify_all();
}

bool Latest::Turn::superseded() const {
  const std::lock_guard lock(latest_.mutex_);
  return !has_it_ || latest_.ended_ || (kind_ == Kind::looks && latest_.newest_ != number_);
}

void Latest::end() {
  const std::lock_guard lock(mutex_);
  ended_ = true;
  changed_.notify_all();
}

}  // namespace rayrep::tool
