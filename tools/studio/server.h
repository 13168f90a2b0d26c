#pragma once

#include <functional>
#include <memory>
#include <string>

#include "session.h"

namespace rayrep::tool {

/// The studio on 127.0.0.1: what is asked of it over HTTP, and of whom.
class Server {
public:
  /// @param session  not owned. @throws Error{usage} for a port that is taken
  Server(Session& session, const StudioOptions& options);
  ~Server();

  /// With the token that all requests have to know.
  std::string address() const;

  /// Answers from now on, from threads of its own.
  void start();
  bool has_ended() const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace rayrep::tool
