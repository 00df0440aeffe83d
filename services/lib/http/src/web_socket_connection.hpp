#pragma once
// WebSocket over a stream (plain or TLS).

#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <utility>

#include "web_socket_handle.hpp"

namespace exemplar::http {

template <class Stream>
class WebSocketConnection final : public Connection,
                                  public std::enable_shared_from_this<WebSocketConnection<Stream>> {
 public:
  WebSocketConnection(Core& core, Stream&& stream, std::unique_ptr<Admitted> admitted)
      : core_(core), admitted_(std::move(admitted)), socket_(std::move(stream)) {}

  ~WebSocketConnection() override { End(); }

  /// `head` is the request; answered on success only.
  template <class Head>
  void Accept(Head head, Upgrade upgrade) {
    namespace websocket = boost::beast::websocket;
    clients_ = upgrade.route->clients;
    ++*clients_;
    const auto& endpoint = std::get<WebSocketEndpoint>(upgrade.route->handler);
    boost::beast::get_lowest_layer(socket_).expires_never();
    websocket::stream_base::timeout timeout{};
    timeout.handshake_timeout = core_.options.limits.request_timeout;
    timeout.idle_timeout = 2 * endpoint.silence;
    timeout.keep_alive_pings = true;
    socket_.set_option(timeout);
    socket_.set_option(websocket::stream_base::decorator(
        [subprotocol = upgrade.subprotocol](websocket::response_type& response) {
          response.set(boost::beast::http::field::server, "exemplar");
          if (!subprotocol.empty()) {
            response.set(boost::beast::http::field::sec_websocket_protocol, subprotocol);
          }
        }));
    socket_.read_message_max(endpoint.message_bytes);
    socket_.auto_fragment(false);
    endpoint_ = &endpoint;
    handle_ = std::make_shared<WebSocketHandle>(admitted_->id(), std::move(upgrade), endpoint,
                                                core_.counters,
                                                [&core = core_, weak = this->weak_from_this()] {
                                                  boost::asio::post(core.network, [weak] {
                                                    if (const auto self = weak.lock()) self->Pump();
                                                  });
                                                });
    auto kept = std::make_shared<Head>(std::move(head));
    socket_.async_accept(*kept, [self = this->shared_from_this(), kept](
                                    boost::system::error_code error) { self->OnAccepted(error); });
  }

  void Finish() override { handle_->Close(1001, "the server stops"); }

  void Cut() override {
    boost::beast::get_lowest_layer(socket_).close();
    End();
  }

 private:
  void OnAccepted(boost::system::error_code error) {
    if (error || core_.stopping) {
      End();
      return;
    }
    ++core_.counters.websockets;
    session_ = endpoint_->open(handle_);
    if (session_ == nullptr) handle_->Close(1013, "try again later");
    Read();
  }

  void Read() {
    socket_.async_read(
        incoming_, [self = this->shared_from_this()](boost::system::error_code error, std::size_t) {
          self->OnRead(error);
        });
  }

  void OnRead(boost::system::error_code error) {
    if (error) {
      CountFailure(error);
      End();
      return;
    }
    ++core_.counters.frames_in;
    const auto data = incoming_.cdata();
    if (session_ != nullptr) {
      if (socket_.got_text()) {
        session_->OnText({static_cast<const char*>(data.data()), data.size()});
      } else {
        session_->OnBinary({static_cast<const std::byte*>(data.data()), data.size()});
      }
    }
    incoming_.consume(incoming_.size());
    Read();
  }

  void CountFailure(boost::system::error_code error) {
    namespace websocket = boost::beast::websocket;
    if (error == boost::beast::error::timeout) {
      ++core_.counters.timeouts;
    } else if (error.category() == make_error_code(websocket::error::closed).category() &&
               error != websocket::error::closed) {
      ++core_.counters.bad_frames;
    }
  }

  void Pump() {
    if (writing_ || ended_) return;
    std::optional<Frame> frame = handle_->Next();
    if (!frame) {
      if (const auto closing = handle_->closing()) CloseSocket(closing->code, closing->reason);
      return;
    }
    writing_ = true;
    outgoing_ = std::move(*frame);
    socket_.binary(outgoing_.binary);
    const std::array<boost::asio::const_buffer, 2> buffers = {
        boost::asio::buffer(outgoing_.head),
        boost::asio::const_buffer(outgoing_.body.data(), outgoing_.body.size())};
    socket_.async_write(
        buffers, [self = this->shared_from_this()](boost::system::error_code error, std::size_t) {
          self->writing_ = false;
          self->outgoing_ = {};
          if (error) {
            self->Cut();
            return;
          }
          self->handle_->CountSent();
          ++self->core_.counters.frames_out;
          self->Pump();
        });
  }

  void CloseSocket(int code, const std::string& reason) {
    if (closing_) return;
    closing_ = true;
    boost::beast::websocket::close_reason why(
        static_cast<boost::beast::websocket::close_code>(code));
    why.reason = reason;
    // A client that does not answer the close is cut by the timeout of the handshake.
    socket_.async_close(why, [self = this->shared_from_this()](boost::system::error_code) {});
  }

  void End() {
    if (ended_ || handle_ == nullptr) return;
    ended_ = true;
    handle_->Abandon();
    if (session_ != nullptr) session_->OnClose();
    session_.reset();
    --*clients_;
  }

  Core& core_;
  std::unique_ptr<Admitted> admitted_;
  boost::beast::websocket::stream<Stream> socket_;
  std::shared_ptr<std::atomic<std::size_t>> clients_;
  const WebSocketEndpoint* endpoint_ = nullptr;
  std::shared_ptr<WebSocketHandle> handle_;
  std::unique_ptr<WebSocketSession> session_;
  boost::beast::flat_buffer incoming_;
  Frame outgoing_;
  bool writing_ = false;
  bool closing_ = false;
  bool ended_ = false;
};

}  // namespace exemplar::http
