// Builds the page into build/page of the repository, or into the folder in ENFILADE_PAGE_OUT.
// index.html is served at /, all other files at /page/.
import { existsSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { defineConfig } from "vite";

const toPath = (relative) => fileURLToPath(new URL(relative, import.meta.url));

/** Writes the licences of all bundled packages to licenses.txt. A package without one ends the build. */
function collectLicenses() {
  const packages = new Map();
  const remember = (module) => {
    const found = /^(.*\/node_modules\/((?:@[^/]+\/)?[^/]+))\//.exec(module.replaceAll("\\", "/"));
    if (found) packages.set(found[2], found[1]);
  };
  const readLicense = (folder) => {
    const name = readdirSync(folder).find((file) => /^licen[cs]e/i.test(file));
    if (name) return readFileSync(join(folder, name), "utf8").trim();
    const { license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
    // Packages of the Buf project name Apache-2.0 without the text, which is that of this repository. Sources of other
    // owners have their licence in the file.
    if (!/Apache-2\.0/.test(license)) throw new Error(`${folder} has no licence`);
    const apache = readFileSync(toPath("../../LICENSE"), "utf8").trim();
    return [apache, ...findNotices(folder)].join("\n\n");
  };
  const modules = new Set();
  const findNotices = (folder) => new Set([...modules].filter((module) => module.startsWith(folder)).flatMap((module) => {
    const head = /^(?:\/\/.*\n)+/.exec(readFileSync(module, "utf8"))?.[0] ?? "";
    return head.includes("Redistribution and use") ? [head.replace(/^\/\/ ?/gm, "").trim()] : [];
  }));
  return {
    name: "licenses",
    generateBundle(_, bundle) {
      for (const chunk of Object.values(bundle)) {
        if (chunk.type !== "chunk") continue;
        for (const module of Object.keys(chunk.modules)) {
          modules.add(module.split("?")[0]);
          remember(module);
        }
      }
      const parts = [...packages].sort().map(([name, folder]) => {
        const { version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
        return `${name} ${version} (${license})\n\n${readLicense(folder)}\n`;
      });
      const line = `\n${"-".repeat(80)}\n\n`;
      this.emitFile({
        type: "asset", fileName: "licenses.txt",
        source: `The page contains these packages:\n${line}${parts.join(line)}`,
      });
    },
  };
}

/** The client lies outside this folder: its packages are those of the page. */
function resolveClientPackages() {
  return {
    name: "client-packages",
    enforce: "pre",
    resolveId(name, importer) {
      if (importer !== client || !name.startsWith("@bufbuild/")) return null;
      return this.resolve(name, toPath("src/client.ts"), { skipSelf: true });
    },
  };
}

const out = process.env.ENFILADE_PAGE_OUT || toPath("../../build/page");
const client = toPath("../../protocol/clients/javascript/enfilade.js");
const protobuf = toPath("node_modules/@bufbuild/protobuf");
if (!existsSync(protobuf)) throw new Error(`run npm ci in ${dirname(toPath("package.json"))} first`);

/** The page of a server: hashed files below /page/. */
const served = {
  outDir: out,
  rollupOptions: {
    input: { index: toPath("index.html"), enfilade: toPath("src/client.ts") },
    // The client is an interface for other pages: its name is stable, and its exports stay.
    preserveEntrySignatures: "exports-only",
    output: {
      entryFileNames: (chunk) => chunk.name === "enfilade" ? "enfilade.js" : "assets/[name]-[hash].js",
    },
  },
};

/** The page of a recording: one script and one style sheet, which `enfilade export --html` puts into a file. */
const replay = {
  outDir: join(out, "replay"),
  cssCodeSplit: false,
  rollupOptions: {
    input: toPath("src/replay.ts"),
    output: { format: "iife", entryFileNames: "replay.js", assetFileNames: "replay.[ext]", inlineDynamicImports: true },
  },
};

export default defineConfig(({ mode }) => ({
  base: "/page/",
  publicDir: mode === "replay" ? false : "public",
  build: {
    emptyOutDir: true,
    target: "es2022",
    chunkSizeWarningLimit: 2000,
    assetsInlineLimit: 0,
    ...(mode === "replay" ? replay : served),
  },
  resolve: {
    alias: [
      { find: "enfilade-client", replacement: client },
      // Only Node.js uses these two; no browser reaches them.
      { find: "ws", replacement: toPath("src/absent.ts") },
      { find: "node:fs/promises", replacement: toPath("src/absent.ts") },
    ],
  },
  plugins: [resolveClientPackages(), collectLicenses()],
}));
