#include "server.h"

#include <httplib.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>

#include <array>
#include <atomic>
#include <new>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <thread>
#include <utility>

#include "child_run.h"
#include "rayrep/base/error.h"
#include "rayrep/report/page_data.h"

namespace rayrep::tool {
namespace {

using httplib::Request;
using httplib::Response;
using Json = nlohmann::ordered_json;

constexpr const char* kJson = "application/json; charset=utf-8";
constexpr std::size_t kMostSettings_bytes = 65536;
constexpr std::size_t kMostWays_bytes = 16'000'000;

std::string random_token() {
  std::array<unsigned char, 16> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1)
    throw Error(ErrorCode::internal, "This system has no random numbers.");
  constexpr const char* kDigits = "0123456789abcdef";
  std::string token;
  for (const unsigned char byte : bytes) token += {kDigits[byte / 16], kDigits[byte % 16]};
  return token;
}

bool same_token(const std::string& a, const std::string& b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

/// By a provider: what is set as content httplib would compress, which takes longer than the way to the browser.
void answer(Response& response, std::string body, const char* type) {
  if (body.empty()) return;
  const std::size_t length = body.size();
  response.set_content_provider(length, type,
                                [body = std::move(body)](std::size_t offset, std::size_t part, httplib::DataSink& sink) {
                                  return sink.write(body.data() + offset, part);
                                });
}

std::string told(const std::string& kind, const std::string& message) {
  const Json error = {{"error", {{"kind", kind}, {"message", message}}}};
  return error.dump(-1, ' ', false, Json::error_handler_t::replace);
}

void refuse(Response& response, int status, const std::string& kind, const std::string& message) {
  response.status = status;
  answer(response, told(kind, message), kJson);
}

/// "attachment; filename=..." for names of any characters: RFC 6266.
std::string disposition(const std::string& name) {
  constexpr const char* kDigits = "0123456789ABCDEF";
  std::string plain, coded;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool simple = (byte >= '0' && byte <= '9') || (byte >= 'A' && byte <= 'Z') || (byte >= 'a' && byte <= 'z') || c == '.' ||
                        c == '-' || c == '_';
    plain += simple ? c : '_';
    coded += simple ? std::string(1, c) : std::string("%") + kDigits[byte / 16] + kDigits[byte % 16];
  }
  return "attachment; filename=\"" + plain + "\"; filename*=UTF-8''" + coded;
}

/// Reads at most so much. @returns none: it was more, or broke off, and is answered
std::optional<std::string> body_of(const httplib::ContentReader& reader, std::size_t most, Response& response) {
  std::string body;
  bool fits = true;
  const bool whole = reader([&](const char* data, std::size_t size) {
    fits = body.size() + size <= most;
    if (fits) body.append(data, size);
    return fits;
  });
  if (whole) return body;
  if (!fits || response.status == 413)
    refuse(response, 413, "usage", "That is more than the " + std::to_string(most / 1'000'000) + " MB that the studio takes.");
  else
    refuse(response, 400, "usage", "The request broke off.");
  return std::nullopt;
}

}  // namespace

struct Server::Impl {
  Session& session;
  std::size_t most_upload;
  std::string token = random_token();
  int port = 0;
  httplib::Server http;
  std::atomic<bool> ended = false;
  std::thread thread;

  Impl(Session& one, const StudioOptions& options) : session(one), most_upload(options.most_upload_bytes) {
    limit();
    route();
    port = options.port;
    if (port == 0)
      port = http.bind_to_any_port("127.0.0.1");
    else if (!http.bind_to_port("127.0.0.1", port))
      port = -1;
    if (port < 0)
      throw Error(ErrorCode::usage, options.port == 0
                                        ? std::string("No port of 127.0.0.1 is free.")
                                        : "Port " + std::to_string(options.port) +
                                              " of 127.0.0.1 is taken, or not for you to use: choose another one with "
                                              "--port, or leave it out.");
  }

  void limit() {
    constexpr int kThreads = 16;
    constexpr int kSlow_s = 5;
    http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    // Without SO_REUSEPORT, which httplib sets: another one could listen on the same port.
    http.set_socket_options([](socket_t socket) {
      const int yes = 1;
      setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    });
    http.set_tcp_nodelay(true);
    http.set_read_timeout(kSlow_s);
    http.set_write_timeout(kSlow_s);
    // One request a connection: what is refused before its body is read leaves nothing behind that would be read as the next one.
    http.set_keep_alive_max_count(1);
    http.set_payload_max_length(most_upload);
    http.set_default_headers({{"Cache-Control", "no-store"},
                              {"X-Content-Type-Options", "nosniff"},
                              {"Referrer-Policy", "no-referrer"},
                              {"X-Frame-Options", "DENY"},
                              {"Cross-Origin-Resource-Policy", "same-origin"},
                              {"Cross-Origin-Opener-Policy", "same-origin"}});
  }

  /// Of this server and nobody else: a name that another one had point to 127.0.0.1 (DNS rebinding) is not among these.
  bool is_own(const std::string& host) const {
    const std::string end = ":" + std::to_string(port);
    return host == "127.0.0.1" + end || host == "localhost" + end;
  }

  bool from_own_page(const Request& request) const {
    if (request.get_header_value_count("Host") != 1 || !is_own(request.get_header_value("Host"))) return false;
    constexpr std::string_view kScheme = "http://";
    for (std::size_t n = 0; n < request.get_header_value_count("Origin"); ++n) {
      const std::string origin = request.get_header_value("Origin", n);
      if (!origin.starts_with(kScheme) || !is_own(origin.substr(kScheme.size()))) return false;
    }
    return true;
  }

  /// The part of the path behind the token; none: it has another one.
  std::optional<std::string> place_of(const Request& request) const {
    const std::string& path = request.path;
    const std::size_t end = path.find('/', 1);
    if (end == std::string::npos || !same_token(path.substr(1, end - 1), token)) return std::nullopt;
    return path.substr(end + 1);
  }

  /// Refuses what need not be looked at. @returns true: it is answered
  bool refused(const Request& request, Response& response) const {
    constexpr std::size_t kLongestName = 255;
    static const std::set<std::string> kGet = {"", "mesh", "run", "result"};
    static const std::set<std::string> kPost = {"mesh", "preview", "run", "cancel", "scene/check", "scene/file", "scene/balance"};
    if (!from_own_page(request)) {
      refuse(response, 403, "usage", "This is for pages of this address only.");
      return true;
    }
    const std::optional<std::string> place = place_of(request);
    const bool download = place && place->starts_with("download/") && place->size() <= kLongestName;
    if (!place || !(kGet.contains(*place) || kPost.contains(*place) || download)) {
      refuse(response, 404, "usage", "There is nothing here. The address is the one that rayrep studio has printed.");
      return true;
    }
    const bool gets = request.method == "GET" || request.method == "HEAD";
    if (!(gets && (kGet.contains(*place) || download)) && !(request.method == "POST" && kPost.contains(*place))) {
      refuse(response, 405, "usage", "Not that way.");
      return true;
    }
    if (!request.has_header("Content-Encoding")) return false;
    refuse(response, 415, "usage", "Send it as it is, not compressed.");
    return true;
  }

  /// Why work was refused, if it was.
  template <typename Work>
  std::optional<Refused> refusal_of(const Work& work) const {
    try {
      work();
      return std::nullopt;
    } catch (const Refused& refusal) {
      return refusal;
    } catch (const Error& error) {
      return Refused(error.code() == ErrorCode::internal ? 500 : 422,
                     error.code() == ErrorCode::interrupted ? "superseded" : kind_of(static_cast<int>(error.code())),
                     session.told(error.what()));
    } catch (const std::bad_alloc&) {
      return Refused(500, "internal", "Out of memory: try a mesh of fewer triangles.");
    } catch (const std::exception& error) {
      return Refused(500, "internal", session.told(error.what()));
    }
  }

  template <typename Work>
  void answered(Response& response, const Work& work) const {
    if (const std::optional<Refused> refusal = refusal_of(work)) refuse(response, refusal->status, refusal->kind, refusal->what());
  }

  void send_page(Response& response) const {
    LivePage page = live_page(session.start());
    response.set_header("Content-Security-Policy", page.policy + "; connect-src 'self'; frame-ancestors 'none'");
    answer(response, std::move(page.html), "text/html; charset=utf-8");
  }

  void get(const std::string& place, const std::function<void(Response&)>& work) {
    http.Get("/" + token + "/" + place,
             [this, work](const Request&, Response& response) { answered(response, [&] { work(response); }); });
  }

  /// @param work  of a body to an answer
  void post(const std::string& place, std::size_t most,
            const std::function<std::string(const Request&, const std::string&, Response&)>& work) {
    http.Post("/" + token + "/" + place,
              [this, most, work](const Request& request, Response& response, const httplib::ContentReader& reader) {
                const std::optional<std::string> body = body_of(reader, most, response);
                if (body) answered(response, [&] { answer(response, work(request, *body, response), kJson); });
              });
  }

  /// Answers with lines of JSON, each as soon as it is known; the last one tells what was refused.
  void send_found(const std::string& edit, Response& response) const {
    response.set_chunked_content_provider("application/x-ndjson", [this, edit](std::size_t, httplib::DataSink& sink) {
      const auto send = [&sink](const std::string& json) {
        const std::string line = json + "\n";
        return sink.write(line.data(), line.size());
      };
      const auto refusal = refusal_of([&] { session.scene().check(edit, send); });
      if (refusal) send(told(refusal->kind, refusal->what()));
      sink.done();
      return true;
    });
  }

  void route() {
    http.set_pre_routing_handler([this](const Request& request, Response& response) {
      return refused(request, response) ? httplib::Server::HandlerResponse::Handled : httplib::Server::HandlerResponse::Unhandled;
    });
    get("", [this](Response& response) { send_page(response); });
    get("mesh", [this](Response& response) { answer(response, session.mesh_bytes(), "application/octet-stream"); });
    get("run", [this](Response& response) { answer(response, session.run_status(), kJson); });
    get("result", [this](Response& response) { answer(response, session.result(), kJson); });
    http.Get("/" + token + "/download/(.+)", [this](const Request& request, Response& response) {
      answered(response, [&] {
        Session::Download file = session.download(request.matches[1]);
        response.set_header("Content-Disposition", disposition(file.name));
        answer(response, std::move(file.bytes), "application/octet-stream");
      });
    });
    post("mesh", most_upload, [this](const Request& request, const std::string& bytes, Response&) {
      return session.load(request.get_param_value("name"), bytes);
    });
    post("preview", kMostSettings_bytes,
         [this](const Request&, const std::string& body, Response&) { return session.preview(body); });
    post("scene/check", kMostWays_bytes, [this](const Request&, const std::string& edit, Response& response) {
      session.scene();  // says so where there is none
      send_found(edit, response);
      return std::string();
    });
    post("scene/balance", kMostWays_bytes,
         [this](const Request&, const std::string& edit, Response&) { return session.scene().balance(edit); });
    post("scene/file", kMostWays_bytes,
         [this](const Request&, const std::string& edit, Response&) { return session.scene().file(edit); });
    post("run", kMostWays_bytes, [this](const Request&, const std::string& body, Response& response) {
      std::string begun = session.begin_run(body);
      response.status = 202;
      return begun;
    });
    post("cancel", kMostSettings_bytes, [this](const Request&, const std::string&, Response& response) {
      session.cancel_run();
      response.status = 204;
      return std::string();
    });
  }
};

Server::Server(Session& session, const StudioOptions& options) : impl_(std::make_unique<Impl>(session, options)) {}

Server::~Server() {
  impl_->http.stop();
  if (impl_->thread.joinable()) impl_->thread.join();
}

std::string Server::address() const { return "http://127.0.0.1:" + std::to_string(impl_->port) + "/" + impl_->token + "/"; }

void Server::start() {
  impl_->thread = std::thread([impl = impl_.get()] {
    impl->http.listen_after_bind();
    impl->ended = true;
  });
}

bool Server::has_ended() const { return impl_->ended; }

}  // namespace rayrep::tool
