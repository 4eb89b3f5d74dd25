// Serves the built page and a plain GLB file in front of a server without a page of its own. For development of the
// page, and for tests of files without entity ids.
//   node page_proxy.mjs PAGE_FOLDER SCENE.glb SERVER_PORT [PORT]
import { createReadStream, existsSync, statSync } from "node:fs";
import { createServer } from "node:http";
import { connect } from "node:net";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";

const TYPES = { ".html": "text/html; charset=utf-8", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml", ".txt": "text/plain; charset=utf-8", ".desc": "application/octet-stream" };
const POLICY = "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; worker-src 'self' blob:; connect-src 'self' ws: wss: blob: data:; script-src 'self' 'wasm-unsafe-eval'";

export function startProxy(page, scene, serverPort, port = 0) {
  const send = (reply, file) => {
    if (!existsSync(file) || !statSync(file).isFile()) return reply.writeHead(404).end();
    reply.writeHead(200, { "Content-Type": TYPES[extname(file)] ?? "application/octet-stream", "Content-Security-Policy": POLICY });
    createReadStream(file).pipe(reply);
  };
  const server = createServer((request, reply) => {
    const { pathname } = new URL(request.url, "http://localhost");
    if (pathname === "/") return send(reply, join(page, "index.html"));
    if (pathname === "/scene.glb") return send(reply, scene);
    if (pathname.startsWith("/page/")) return send(reply, join(page, normalize(pathname.slice(5))));
    const upstream = connect(serverPort, "127.0.0.1", () => upstream.write(makeHead(request, serverPort)));
    upstream.on("error", () => reply.destroy());
    upstream.pipe(reply.socket);
  });
  server.on("upgrade", (request, socket) => {
    const upstream = connect(serverPort, "127.0.0.1", () => upstream.write(makeHead(request, serverPort)));
    upstream.on("error", () => socket.destroy());
    socket.on("error", () => upstream.destroy());
    upstream.pipe(socket).pipe(upstream);
  });
  return new Promise((resolve) => server.listen(port, "127.0.0.1", () => resolve(server)));
}

/** The request's head for the server, which admits only its own address as host and origin. */
function makeHead(request, port) {
  const own = `127.0.0.1:${port}`;
  const lines = [`${request.method} ${request.url} HTTP/1.1`];
  for (const [name, value] of Object.entries(request.headers)) {
    lines.push(`${name}: ${name === "host" ? own : name === "origin" ? `http://${own}` : value}`);
  }
  return `${lines.join("\r\n")}\r\n\r\n`;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const [page, scene, serverPort, port] = process.argv.slice(2);
  const server = await startProxy(page, scene, Number(serverPort), Number(port ?? 7900));
  console.log(`http://127.0.0.1:${server.address().port}/`);
}
