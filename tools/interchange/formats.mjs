// Reads a file with libraries of npm: `formats.mjs gltf FILE` prints its errors, `formats.mjs copc FILE` its points.
import { open, readFile } from "node:fs/promises"
import { createRequire } from "node:module"

const require = createRequire(import.meta.url)
const [kind, path] = process.argv.slice(2)

if (kind === "gltf") {
    const validator = require("gltf-validator")
    const report = await validator.validateBytes(new Uint8Array(await readFile(path)))
    const messages = report.issues.messages.filter((message) => message.severity < 2)
    console.log(JSON.stringify({ errors: report.issues.numErrors, warnings: report.issues.numWarnings, messages }))
} else {
    const { Copc } = require("copc")
    const file = await open(path)
    const get = async (begin, end) => {
        const buffer = Buffer.alloc(end - begin)
        const { bytesRead } = await file.read(buffer, 0, end - begin, begin)
        return new Uint8Array(buffer.subarray(0, bytesRead))
    }
    const copc = await Copc.create(get)
    const { nodes } = await Copc.loadHierarchyPage(get, copc.info.rootHierarchyPage)
    const { cube, spacing } = copc.info
    const result = { header: copc.header.pointCount, wkt: copc.wkt ?? null, levels: {}, outside: 0, points: [] }
    for (const [key, node] of Object.entries(nodes)) {
        if (!node.pointCount) continue
        const [level, ...place] = key.split("-").map(Number)
        const edge = (cube[3] - cube[0]) / 2 ** level
        const view = await Copc.loadPointDataView(get, copc, node)
        const getters = ["X", "Y", "Z", "log_odds", "count"].map((name) => view.getter(name))
        result.levels[level] = (result.levels[level] ?? 0) + view.pointCount
        for (let k = 0; k < view.pointCount; k++) {
            const point = getters.map((getter) => getter(k))
            for (let axis = 0; axis < 3; axis++) {
                const at = (point[axis] - cube[axis]) / edge
                if (!(at >= place[axis] && at < place[axis] + 1)) result.outside++
            }
            result.points.push(point)
        }
    }
    result.spacing = spacing
    console.log(JSON.stringify(result))
    await file.close()
}
