#pragma once
// HTTP/1.1 over a stream (plain or TLS): one request at a time, kept alive between them.

#include <boost/asio/ssl/error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <limits>
#include <sstream>
#include <stop_token>
#include <type_traits>
#include <utility>

#include "answer_stream.hpp"
#include "exchange.hpp"
#include "web_socket_connection.hpp"

namespace exemplar::http {

/// On the network thread. While a handler runs, the socket is read on, to notice when the client
/// goes; what comes in is the next request's beginning.
template <class Stream>
class HttpConnection final : public Connection,
                             public std::enable_shared_from_this<HttpConnection<Stream>> {
 public:
  HttpConnection(Core& core, Stream&& stream, std::unique_ptr<Admitted> admitted, bool tls,
                 std::string certificate_subject)
      : core_(core),
        admitted_(std::move(admitted)),
        stream_(std::move(stream)),
        patience_(core.network),
        tls_(tls),
        certificate_subject_(std::move(certificate_subject)) {}

  /// The last to hold the connection may be a handler's thread.
  ~HttpConnection() override {
    if (!admitted_) return;
    boost::asio::post(core_.network, [place = std::move(admitted_)] {});
  }

  void Start() {
    core_.connections[admitted_->id()] = this->weak_from_this();
    AwaitRequest(core_.options.limits.request_timeout);
  }

  void Finish() override {
    finishing_ = true;
    gone_.request_stop();
    if (!serving_) Cut();
  }

  void Cut() override {
    gone_.request_stop();
    if (answer_) answer_->Abandon();
    patience_.cancel();
    boost::beast::get_lowest_layer(stream_).close();
  }

 private:
  using Error = boost::system::error_code;
  using Empty = boost::beast::http::empty_body;

  /// The socket's own timer cannot be set while a read is underway, so this one watches the wait
  /// for a request.
  void AllowFor(Duration patience) {
    patience_.expires_after(patience);
    patience_.async_wait([self = this->shared_from_this()](Error error) {
      if (error || self->serving_) return;
      if (self->in_request_ || !self->answered_) ++self->core_.counters.timeouts;
      self->Cut();
    });
  }

  void AwaitRequest(Duration patience) {
    AllowFor(buffer_.size() > 0 ? core_.options.limits.request_timeout : patience);
    if (watching_) return;
    if (buffer_.size() > 0) {
      ReadHead();
    } else {
      Watch();
    }
  }

  void Watch() {
    watching_ = true;
    constexpr std::size_t kPiece = 4096;
    stream_.async_read_some(buffer_.prepare(kPiece),
                            [self = this->shared_from_this()](Error error, std::size_t bytes) {
                              self->watching_ = false;
                              self->buffer_.commit(bytes);
                              self->OnWatched(error);
                            });
  }

  void OnWatched(Error error) {
    if (error) {
      half_closed_ = true;
      gone_.request_stop();
      if (!serving_ || leaving_) Cut();
      return;
    }
    if (leaving_) {
      Drain();
    } else if (!serving_) {  // else a request that was sent ahead waits in the buffer
      AllowFor(core_.options.limits.request_timeout);
      ReadHead();
    }
  }

  void ReadHead() {
    in_request_ = true;
    decision_ = {};
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(core_.options.limits.header_bytes));
    parser_->body_limit(std::numeric_limits<std::uint64_t>::max());  // the route's comes later
    boost::beast::http::async_read_header(
        stream_, buffer_, *parser_,
        [self = this->shared_from_this()](Error error, std::size_t) { self->OnHead(error); });
  }

  void OnHead(Error error) {
    namespace beast_http = boost::beast::http;
    if (error) {
      OnBadRequest(error);
      return;
    }
    const RequestHead& head = parser_->get();
    version_ = head.version();
    keep_alive_ = head.keep_alive();
    is_head_ = head.method() == beast_http::verb::head;
    decision_ = Decide(core_, head, boost::beast::websocket::is_upgrade(head), admitted_->peer(),
                       tls_, certificate_subject_);
    if (decision_.refusal) {
      keep_alive_ = keep_alive_ && parser_->is_done();
      serving_ = true;
      Answer(std::move(*decision_.refusal));
      return;
    }
    if (decision_.upgrade) {
      BecomeWebSocket();
      return;
    }
    ReadBody();
  }

  void OnBadRequest(Error error) {
    namespace beast_http = boost::beast::http;
    if (error.category() != make_error_code(beast_http::error::bad_method).category() ||
        error == beast_http::error::end_of_stream || error == beast_http::error::partial_message) {
      Cut();
      return;
    }
    ++core_.counters.bad_requests;
    const int status = error == beast_http::error::header_limit ? 431
                       : error == beast_http::error::body_limit ? 413
                                                                : 400;
    keep_alive_ = false;
    serving_ = true;
    version_ = 11;
    Answer({status, {{"Content-Type", "text/plain; charset=utf-8"}}, error.message() + "\n"});
  }

  void ReadBody() {
    const RequestHead& head = parser_->get();
    const std::size_t own = decision_.route->options.body_bytes;
    const std::size_t limit = own > 0 ? own : core_.options.limits.body_bytes;
    parser_->body_limit(limit);
    if (parser_->content_length().value_or(0) > limit) {
      OnBadRequest(boost::beast::http::error::body_limit);
      return;
    }
    if (!boost::beast::iequals(head[boost::beast::http::field::expect], "100-continue") ||
        parser_->is_done()) {
      ReadRest();
      return;
    }
    static constexpr std::string_view kContinue = "HTTP/1.1 100 Continue\r\n\r\n";
    boost::asio::async_write(stream_, boost::asio::buffer(kContinue),
                             [self = this->shared_from_this()](Error error, std::size_t) {
                               if (error) {
                                 self->Cut();
                               } else {
                                 self->ReadRest();
                               }
                             });
  }

  void ReadRest() {
    boost::beast::http::async_read(stream_, buffer_, *parser_,
                                   [self = this->shared_from_this()](Error error, std::size_t) {
                                     if (error) {
                                       self->OnBadRequest(error);
                                     } else {
                                       self->Serve();
                                     }
                                   });
  }

  void Serve() {
    serving_ = true;
    patience_.cancel();
    gone_ = std::stop_source();
    auto request = std::make_shared<Request>(std::move(decision_.request));
    request->body = std::move(parser_->get().body());
    request->gone = gone_.get_token();
    if (core_.stopping) gone_.request_stop();
    const RouteEntry& route = *decision_.route;
    if (buffer_.size() == 0) Watch();
    auto self = this->shared_from_this();
    bool runs = false;
    if (std::holds_alternative<StreamHandler>(route.handler)) {
      runs = StartStream(route, std::move(request));
    } else {
      runs = RunHandler(core_, route, std::move(request), [self](Response response) {
        boost::asio::post(self->core_.network, [self, response = std::move(response)]() mutable {
          self->Answer(std::move(response));
        });
      });
    }
    if (runs) return;
    ++core_.counters.refused_requests;
    answer_.reset();
    Answer({503,
            {{"Content-Type", "text/plain; charset=utf-8"}, {"Retry-After", "1"}},
            "too many requests at once\n"});
  }

  /// Writes a whole answer.
  void Answer(Response response) {
    namespace beast_http = boost::beast::http;
    keep_alive_ = keep_alive_ && !finishing_ && !core_.stopping;
    auto message = std::make_shared<beast_http::response<beast_http::string_body>>(
        HeadOf(response.status, response.headers, decision_.extra, version_).base());
    message->keep_alive(keep_alive_);
    const bool bodiless = response.status == 204 || response.status == 304;
    if (!bodiless) message->content_length(response.body.size());
    if (!is_head_ && !bodiless) message->body() = std::move(response.body);
    auto serializer =
        std::make_shared<beast_http::response_serializer<beast_http::string_body>>(*message);
    WriteSome(std::move(message), std::move(serializer));
  }

  template <class Message, class Serializer>
  void WriteSome(Message message, Serializer serializer) {
    boost::beast::get_lowest_layer(stream_).expires_after(core_.options.limits.write_timeout);
    auto& writing = *serializer;
    boost::beast::http::async_write_some(
        stream_, writing,
        [self = this->shared_from_this(), message = std::move(message),
         serializer = std::move(serializer)](Error error, std::size_t) mutable {
          if (error) {
            self->OnWriteFailed(error);
          } else if (serializer->is_done()) {
            self->OnAnswered();
          } else {
            self->WriteSome(std::move(message), std::move(serializer));
          }
        });
  }

  void OnWriteFailed(Error error) {
    if (error == boost::beast::error::timeout) ++core_.counters.timeouts;
    Cut();
  }

  void OnAnswered() {
    serving_ = false;
    in_request_ = false;
    answered_ = true;
    answer_.reset();
    boost::beast::get_lowest_layer(stream_).expires_never();
    if (!keep_alive_ || half_closed_ || finishing_) {
      Leave();
      return;
    }
    AwaitRequest(core_.options.limits.idle_timeout);
  }

  /// Says that nothing more comes, and gives the client a moment to take what was sent: a socket
  /// that is closed with bytes unread would take the answer back.
  void Leave() {
    if (half_closed_) {
      Cut();
      return;
    }
    serving_ = true;
    leaving_ = true;
    patience_.expires_after(std::chrono::milliseconds(core_.stopping ? 100 : 1000));
    patience_.async_wait([self = this->shared_from_this()](Error error) {
      if (!error) self->Cut();
    });
    if constexpr (std::is_same_v<Stream, boost::beast::tcp_stream>) {
      Error ignored;
      stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
      Drain();
    } else {
      stream_.async_shutdown([self = this->shared_from_this()](Error) { self->Cut(); });
    }
  }

  void Drain() {
    constexpr std::size_t kMost = 4 << 20;
    if (watching_) return;
    drained_ += buffer_.size();
    buffer_.consume(buffer_.size());
    if (drained_ > kMost) {
      Cut();
    } else {
      Watch();
    }
  }

  bool StartStream(const RouteEntry& route, std::shared_ptr<Request> request) {
    auto self = this->shared_from_this();
    answer_ = std::make_shared<AnswerStream>(core_.options.limits.stream_bytes, [self] {
      boost::asio::post(self->core_.network, [self] { self->PumpStream(); });
    });
    return core_.pool->Run([self, &route, request = std::move(request), answer = answer_] {
      try {
        std::get<StreamHandler>(route.handler)(*request, *answer);
      } catch (const std::exception& problem) {
        self->core_.log.Error("a handler failed",
                              {{"path", route.pattern.text()}, {"what", problem.what()}});
      }
      answer->End();
    });
  }

  void PumpStream() {
    namespace beast_http = boost::beast::http;
    if (pumping_ || !answer_) return;
    std::optional<AnswerStream::Next> next = answer_->Take();
    if (!next) return;
    std::string bytes;
    const bool chunked = version_ >= 11;
    if (next->head) {
      keep_alive_ = keep_alive_ && chunked && !finishing_;
      auto head = HeadOf(next->head->status, next->head->headers, decision_.extra, version_);
      if (next->head->status >= 500) ++core_.counters.handler_failures;
      head.keep_alive(keep_alive_);
      if (chunked) head.chunked(true);
      std::ostringstream text;
      text << head.base();
      bytes = text.str();
    }
    if (!is_head_) {
      if (chunked && !next->bytes.empty()) {
        std::ostringstream size;
        size << std::hex << next->bytes.size();
        bytes += size.str() + "\r\n" + next->bytes + "\r\n";
      } else {
        bytes += next->bytes;
      }
      if (chunked && next->ended) bytes += "0\r\n\r\n";
    }
    WriteStream(std::make_shared<std::string>(std::move(bytes)), 0, next->bytes.size(),
                next->ended);
  }

  void WriteStream(std::shared_ptr<std::string> bytes, std::size_t from, std::size_t of_handler,
                   bool last) {
    if (from == bytes->size()) {
      pumping_ = false;
      answer_->Sent(of_handler);
      if (last) {
        OnAnswered();
      } else {
        PumpStream();
      }
      return;
    }
    pumping_ = true;
    boost::beast::get_lowest_layer(stream_).expires_after(core_.options.limits.write_timeout);
    const auto left = boost::asio::buffer(*bytes) + from;
    stream_.async_write_some(left, [self = this->shared_from_this(), bytes, from, of_handler, last](
                                       Error error, std::size_t written) mutable {
      if (error) {
        self->OnWriteFailed(error);
      } else {
        self->WriteStream(std::move(bytes), from + written, of_handler, last);
      }
    });
  }

  void BecomeWebSocket() {
    if (buffer_.size() > 0) {  // frames before the answer: no client of the protocol does that
      OnBadRequest(boost::beast::http::error::unexpected_body);
      return;
    }
    patience_.cancel();
    serving_ = true;
    Upgrade upgrade{decision_.route, std::move(decision_.request), decision_.subprotocol};
    Core& core = core_;
    const std::uint64_t id = admitted_->id();
    auto next = std::make_shared<WebSocketConnection<Stream>>(core, std::move(stream_),
                                                              std::move(admitted_));
    core.connections[id] = next;
    next->Accept(parser_->release(), std::move(upgrade));
  }

  Core& core_;
  std::unique_ptr<Admitted> admitted_;
  Stream stream_;
  boost::asio::steady_timer patience_;
  const bool tls_;
  const std::string certificate_subject_;

  boost::beast::flat_buffer buffer_;
  std::optional<boost::beast::http::request_parser<boost::beast::http::string_body>> parser_;
  Decision decision_;
  unsigned version_ = 11;
  bool keep_alive_ = false;
  bool is_head_ = false;
  bool in_request_ = false;   ///< some of it has come
  bool serving_ = false;      ///< from the whole request to the whole answer
  bool answered_ = false;     ///< at least once
  bool leaving_ = false;      ///< the last answer is out
  bool watching_ = false;     ///< a read is underway
  bool half_closed_ = false;  ///< the client sends nothing more
  bool finishing_ = false;    ///< the server stops
  bool pumping_ = false;
  std::size_t drained_ = 0;
  std::stop_source gone_;
  std::shared_ptr<AnswerStream> answer_;
};

}  // namespace exemplar::http
