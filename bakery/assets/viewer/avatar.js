var D=Math.PI/180;function W([s,t,e]){let o=Math.hypot(s,t,e);if(o<1e-12)return[1,0,0,0,1,0,0,0,1];[s,t,e]=[s/o,t/o,e/o];let r=Math.cos(o),i=Math.sin(o),n=1-r;return[r+s*s*n,s*t*n-e*i,s*e*n+t*i,t*s*n+e*i,r+t*t*n,t*e*n-s*i,e*s*n-t*i,e*t*n+s*i,r+e*e*n]}function K(s,t,e=0){let[o,r]=[Math.cos(s*D),Math.sin(s*D)],[i,n]=[Math.cos(t*D),Math.sin(t*D)],[c,a]=[Math.cos(-e*D),Math.sin(-e*D)],l=j([o,0,r,0,1,0,-r,0,o],[1,0,0,0,i,-n,0,n,i]);return j(l,[c,-a,0,a,c,0,0,0,1])}function j(s,t){let e=new Array(9);for(let o=0;o<3;o++)for(let r=0;r<3;r++)e[3*o+r]=s[3*o]*t[r]+s[3*o+1]*t[3+r]+s[3*o+2]*t[6+r];return e}var P=(s,[t,e,o])=>[s[0]*t+s[1]*e+s[2]*o,s[3]*t+s[4]*e+s[5]*o,s[6]*t+s[7]*e+s[8]*o];function F(s){let{focal:t,center:e,translation:o,width:r,height:i}=s;return{rotation:W(s.rotation),translation:o,focal:t,center:e,width:r,height:i}}function lt(s,t,e,o){let i=P(s.rotation,o).map((a,l)=>a+s.translation[l]),n=K(t,e),c=P(n,o);return{...s,rotation:n,translation:i.map((a,l)=>a-c[l])}}function O(s,t,e,o,r,i=[0,0]){return{...s,focal:s.focal*e,center:[(s.center[0]-t[0])*e+o/2+i[0],(s.center[1]-t[1])*e+r/2+i[1]],width:o,height:r}}function ft(s,t,e){let o=P(t,e),r=P(s.rotation,e.map((i,n)=>i-o[n]));return{...s,rotation:j(s.rotation,t),translation:s.translation.map((i,n)=>i+r[n])}}function C(s,t){let[e,o,r]=P(s.rotation,t).map((n,c)=>n+s.translation[c]),i=s.focal/-r;return[s.center[0]+e*i,s.center[1]-o*i,-r]}function q({rotation:s,translation:t}){return new Float32Array([s[0],s[3],s[6],0,s[1],s[4],s[7],0,s[2],s[5],s[8],0,t[0],t[1],t[2],1])}function Z({focal:s,center:t,width:e,height:o,translation:r}){let i=-r[2],n=Math.max(i-450,i*.05,1),c=i+550;return new Float32Array([2*s/e,0,0,0,0,2*s/o,0,0,1-2*t[0]/e,2*t[1]/o-1,-(c+n)/(c-n),-1,0,0,-2*c*n/(c-n),0])}var E=class extends Error{},ut=/^[A-Za-z0-9_][A-Za-z0-9._-]*$/,Bt=64*2**20,zt=256*2**20,Gt=16384,A=52,mt=8;async function dt(s){let t=new URL(s.endsWith("/")?s:s+"/",document.baseURI),e=async i=>{let n=await fetch(new URL(i,t));if(!n.ok)throw new E(`${i}: ${n.status} ${n.statusText}`);return new Uint8Array(await n.arrayBuffer())},o=["","web/"];t.pathname.endsWith(".avatar/")&&o.reverse();let r=null;for(let i of o){let n=c=>e(i+c);try{let c=JSON.parse(new TextDecoder().decode(await n("avatar.json")));if(!Array.isArray(c.files))return{description:c,file:n}}catch(c){if(!(c instanceof E))throw c;r??=c}}throw r??new E(`${s}: holds no web/avatar.json; bake it again`)}var J=s=>s.geometry??"head.glb";function gt(s){let t=(n,c)=>{if(!n)throw new E(`the bundle's web/avatar.json: ${c}; bake it again`)};t(s&&s.$schema==="urn:bakery:schema:web-1","is not one");let e=String(s.asset?.version);t(/^1\.\d+$/.test(e),`has version ${e.slice(0,20)}, this player reads 1.x`),t(vt(s),"holds a number that is none");let o=s.expressions;t(Array.isArray(o)&&o.length===A,"lacks the 52 expressions"),t(ut.test(J(s)),"names a file outside of its folder"),t(o.every(n=>/^[A-Za-z]{1,40}$/.test(n)),"has an odd expression"),t(s.keys?.length>=1&&s.keys.length<=mt,`needs 1 to ${mt} keys`),t(s.keys.every(n=>_(n.weights,A)),"keys lack weights"),t(_(s.lips?.rest,80)&&s.lips.shapes?.length===A,"lacks the lips"),t(s.lips.shapes.every(n=>_(n,80)),"lacks the lips"),t(s.mouths?.length>=1&&s.mouths.length<=300,"needs 1 to 300 mouths"),t(s.mouths.every(n=>_(n,80)),"mouths lack landmarks"),t(s.gaze?.length>=1&&s.gaze.every(n=>_(n,2)),"lacks gaze"),t(_(s.pose?.weights,A),"lacks the pose of the photo"),t(_(s.pivot,3)&&s.light?.length===9,"lacks its frame"),t(s.eyes?.cap>0&&_(s.eyes.degrees,2),"lacks eyes"),t(s.eyes.centers?.length===2&&s.eyes.centers.every(n=>_(n,3)),"lacks eyes");for(let n of["photo_camera","front_camera"]){let c=s[n];t(c&&c.focal>0&&_(c.center,2),`lacks ${n}`),t(_(c.rotation,3)&&_(c.translation,3),`lacks ${n}`),t(c.width>0&&c.height>0,`lacks ${n}`)}for(let n of["mouth_sheet","eye_cap_left","eye_cap_right"])t(_(s.uv?.[n],4),`lacks the place of ${n}`);let r=["neutral",...s.keys.map(n=>n.name),"gaze","mouths","masks","coverage"];for(let n of r)t(Object.hasOwn(s.atlases??{},n),"lacks a picture");for(let n of Object.values(s.atlases))t(ut.test(n.file??""),"names a file outside of its folder"),t(pt(n.columns)&&pt(n.rows),"has an odd grid"),t(n.names?.length<=n.columns*n.rows,"has an odd grid");let i=(n,c)=>t(s.atlases[n].names.length===c,`${n} differ in number`);i("gaze",s.gaze.length),i("mouths",s.mouths.length),i("masks",A)}var _=(s,t)=>Array.isArray(s)&&s.length===t&&s.every(e=>typeof e=="number"),pt=s=>Number.isInteger(s)&&s>=1&&s<=1024;function vt(s){return typeof s=="number"?Number.isFinite(s):s&&typeof s=="object"?Object.values(s).every(vt):!0}function Xt(s){let t=new DataView(s.buffer,s.byteOffset,s.byteLength),e=o=>String.fromCharCode(...s.subarray(o,o+4));if(s.length>24&&t.getUint32(0)===2303741511)return[t.getUint32(16),t.getUint32(20)];if(s.length>30&&e(0)==="RIFF"&&e(8)==="WEBP"){let o=e(12);if(o==="VP8 ")return[t.getUint16(26,!0)&16383,t.getUint16(28,!0)&16383];if(o==="VP8L"){let r=t.getUint32(21,!0);return[(r&16383)+1,(r>>>14&16383)+1]}if(o==="VP8X"){let r=i=>t.getUint16(i,!0)+(s[i+2]<<16);return[r(24)+1,r(27)+1]}}throw new E("a picture of the bundle is neither PNG nor WebP; bake it again")}async function Et(s,t){let e=await s.file(t.file);if(e.length>zt)throw new E(`${t.file}: too large`);let[o,r]=Xt(e);if(o*r>Bt||Math.max(o,r)>Gt)throw new E(`${t.file}: ${o} x ${r} pixels, more than any bundle has`);if(o%t.columns||r%t.rows)throw new E(`${t.file}: does not divide into its grid; bake it again`);let i=e[0]===137?"image/png":"image/webp";return createImageBitmap(new Blob([e],{type:i}),{premultiplyAlpha:"none",colorSpaceConversion:"none"})}var b=class{constructor(t,e,o){this.gl=t,this.handle=t.createProgram();for(let[r,i]of[[t.VERTEX_SHADER,e],[t.FRAGMENT_SHADER,o]]){let n=t.createShader(r);t.shaderSource(n,`#version 300 es
`+i),t.compileShader(n),t.attachShader(this.handle,n),t.deleteShader(n)}t.linkProgram(this.handle),this.places=null}use(){let{gl:t}=this;if(t.useProgram(this.handle),this.places)return;if(!t.getProgramParameter(this.handle,t.LINK_STATUS)&&!t.isContextLost()){let o=t.getAttachedShaders(this.handle).map(r=>t.getShaderInfoLog(r));throw new E(`this browser's graphics refuse a shader: ${o.join(" ").slice(0,300)}`)}this.places=new Map;let e=t.getProgramParameter(this.handle,t.ACTIVE_UNIFORMS);for(let o=0;o<e;o++){let r=t.getActiveUniform(this.handle,o).name.replace("[0]","");this.places.set(r,t.getUniformLocation(this.handle,r))}}at(t){return this.places.get(t)??null}textures(t){let{gl:e}=this,o=0;for(let[r,[i,n]]of Object.entries(t))e.activeTexture(e.TEXTURE0+o),e.bindTexture(i,n),e.uniform1i(this.at(r),o++)}};function L(s,{format:t,width:e,height:o,layers:r=0,linear:i=!1}){let n=r?s.TEXTURE_2D_ARRAY:s.TEXTURE_2D,c=s.createTexture();s.bindTexture(n,c),r?s.texStorage3D(n,1,t,e,o,r):s.texStorage2D(n,1,t,e,o);let a=i?s.LINEAR:s.NEAREST;return s.texParameteri(n,s.TEXTURE_MIN_FILTER,a),s.texParameteri(n,s.TEXTURE_MAG_FILTER,a),s.texParameteri(n,s.TEXTURE_WRAP_S,s.CLAMP_TO_EDGE),s.texParameteri(n,s.TEXTURE_WRAP_T,s.CLAMP_TO_EDGE),c}var k=class{constructor(t,{format:e,width:o,height:r,count:i=1,linear:n=!1,depth:c=!1}){this.gl=t,this.width=o,this.height=r,this.textures=Array.from({length:i},()=>L(t,{format:e,width:o,height:r,linear:n})),this.handle=t.createFramebuffer(),t.bindFramebuffer(t.FRAMEBUFFER,this.handle);let a=this.textures.map((l,h)=>(t.framebufferTexture2D(t.FRAMEBUFFER,t.COLOR_ATTACHMENT0+h,t.TEXTURE_2D,l,0),t.COLOR_ATTACHMENT0+h));t.drawBuffers(a),this.depth=null,c&&(this.depth=t.createRenderbuffer(),t.bindRenderbuffer(t.RENDERBUFFER,this.depth),t.renderbufferStorage(t.RENDERBUFFER,t.DEPTH_COMPONENT24,o,r),t.framebufferRenderbuffer(t.FRAMEBUFFER,t.DEPTH_ATTACHMENT,t.RENDERBUFFER,this.depth)),this.complete=t.checkFramebufferStatus(t.FRAMEBUFFER)===t.FRAMEBUFFER_COMPLETE,t.bindFramebuffer(t.FRAMEBUFFER,null)}bind(){this.gl.bindFramebuffer(this.gl.FRAMEBUFFER,this.handle),this.gl.viewport(0,0,this.width,this.height)}dispose(){let{gl:t}=this;this.textures.forEach(e=>t.deleteTexture(e)),this.depth&&t.deleteRenderbuffer(this.depth),t.deleteFramebuffer(this.handle)}};var Ht=[0,2,4,8];function Q(s,t,e){let o=s.length-e;if(s[0]!==160||o<1)throw new E("packed vertices of another version");let r=new Uint8Array(t*e),i=s.slice(o),n=Math.min((8192/e|0)&-16,256),c=new Uint8Array(256),a=1;for(let l=0;l<t;l+=n){let h=Math.min(n,t-l),d=h+15>>4;for(let f=0;f<e;f++){let p=a;a+=d+3>>2;for(let m=0;m<d;m++){let g=s[p+(m>>2)]>>((m&3)<<1)&3;a=$t(s,a,Ht[g],c,m<<4)}if(a>o)throw new E("packed vertices that end too soon");let u=i[f];for(let m=0,g=l*e+f;m<h;m++,g+=e){let v=c[m];u=u+(v>>>1^-(v&1))&255,r[g]=u}i[f]=u}}return r}function $t(s,t,e,o,r){if(e===0)return o.fill(0,r,r+16),t;if(e===8){for(let a=0;a<16;a++)o[r+a]=s[t+a];return t+16}let i=(1<<e)-1,n=8/e,c=t+16/n;for(let a=0;a<16;a++){let l=8-e-a%n*e,h=s[t+(a/n|0)]>>l&i;o[r+a]=h===i?s[c++]:h}return c}function tt(s,t){if(s[0]!==209)throw new E("packed indices of another version");let e=new Uint32Array(t),o=new Uint32Array(2),r=1;for(let i=0;i<t;i++){let n=0,c,a=0;do{if(r>=s.length)throw new E("packed indices that end too soon");c=s[r++],n|=(c&127)<<a,a+=7}while(c>127);let l=n&1,h=n>>>1;e[i]=o[l]+=h>>>1^-(h&1)}return e}var xt=["eye_cap_left","eye_cap_right","skin","mouth_sheet"],et=[...xt,"tongue","eye_socket"],B=["tear","lashes"],S=[...et,"inside","teeth",...B],wt=65535;function yt(s){let{document:t,binary:e}=Vt(s),o=t.meshes?.[0],r=t.nodes?.[0]?.scale;(!o||!r||o.extras?.targetNames?.length!==A)&&T("lacks its 52 shapes");let i=r[0]*1e3,n=new Map(o.primitives.map(m=>[t.materials[m.material].name,m])),c=S.filter(m=>n.has(m));xt.some(m=>!n.has(m))&&T("lacks its skin, eyes or mouth");let a=m=>Wt(t,e,m),l=c.map(m=>t.accessors[n.get(m).attributes.POSITION].count),h=l.reduce((m,g)=>m+g,0);h>wt&&T(`has ${h} vertices, more than ${wt}`);let d=c.map(m=>t.accessors[n.get(m).indices].count),f={positions:new Float32Array(3*h),normals:new Int8Array(4*h),uv:new Float32Array(2*h),part:new Uint8Array(h),indices:new Uint16Array(d.reduce((m,g)=>m+g,0)),shapes:new Int16Array(A*4*h),reach:i,ranges:{},hair:Yt(t,a)},p=0,u=0;return c.forEach((m,g)=>{let{attributes:v,indices:w,targets:y}=n.get(m),M=a(v.POSITION);for(let x=0;x<M.length;x++)f.positions[3*p+x]=M[x]*i;f.normals.set(a(v.NORMAL),4*p),f.uv.set(a(v.TEXCOORD_0),2*p),f.part.fill(S.indexOf(m),p,p+l[g]);let R=a(w);for(let x=0;x<R.length;x++)R[x]>=l[g]&&T("has a triangle without a corner"),f.indices[u+x]=R[x]+p;y?.length!==A&&T("lacks its 52 shapes"),y.forEach((x,N)=>f.shapes.set(a(x.POSITION),4*(N*h+p))),f.ranges[m]=[u,R.length],p+=l[g],u+=R.length}),f}function Yt(s,t){let e=s.meshes.findIndex(h=>h.name==="hair");if(e<0||!s.meshes[e].primitives?.length)return null;let o=s.nodes.find(h=>h.mesh===e)?.scale?.[0]*1e3,{primitives:r}=s.meshes[e],{POSITION:i,NORMAL:n,TEXCOORD_0:c}=r[0].attributes,a={positions:t(i).map(h=>h*o),normals:t(n),uv:t(c),levels:[]},l=a.positions.length/3;(!(o>0)||a.normals.length!==4*l||a.uv.length!==2*l)&&T("has damaged hair");for(let{attributes:h,indices:d,extras:f}of r){let p=Uint32Array.from(t(d)),{level:u,cards:m}=f??{};(h.POSITION!==i||!(u>=0&&u<3)||!Array.isArray(m))&&T("has damaged hair"),p.some(w=>w>=l)&&T("has a triangle without a corner");let g=a.levels[u]??={cap:new Uint32Array(0),cards:new Uint32Array(0),starts:[]};if(!m.length){g.cap=p;continue}let v=0;g.starts=m.map(w=>Number.isInteger(w)&&w>0?(v+=3*w)-3*w:T("has damaged hair")),v!==p.length&&T("has damaged hair"),g.cards=p}return a}function T(s){throw new E(`the bundle's head for browsers ${s}; bake it again`)}function Vt(s){let t=new DataView(s.buffer,s.byteOffset,s.byteLength);(s.length<20||t.getUint32(0,!0)!==1179937895)&&T("is no GLB file");let e=t.getUint32(12,!0);return 20+e+8>s.length&&T("is cut short"),{document:JSON.parse(new TextDecoder().decode(s.subarray(20,20+e))),binary:s.subarray(28+e)}}var jt={5120:Int8Array,5122:Int16Array,5123:Uint16Array,5125:Uint32Array,5126:Float32Array};function Wt(s,t,e){let o=s.accessors[e],r=s.bufferViews[o.bufferView].extensions.EXT_meshopt_compression,{byteOffset:i=0,byteLength:n,byteStride:c,count:a,mode:l}=r;(a!==o.count||a>4*2**20||c>256)&&T("is damaged"),i+n>t.length&&T("is cut short");let h=t.subarray(i,i+n),d=jt[o.componentType];return l==="ATTRIBUTES"?new d(Q(h,a,c).buffer):d.from(tt(h,a))}var z=class{constructor(t,e){this.size=e.rest.length,this.known=new Float64Array(t.length*this.size),this.length=new Float64Array(t.length),t.forEach((o,r)=>{this.known.set(o,r*this.size),this.length[r]=Math.hypot(...o)}),this.rest=Float64Array.from(e.rest),this.shapes=e.shapes.map(o=>Float64Array.from(o)),this.moves=this.shapes.map(o=>o.some(r=>r!==0)),this.wanted=new Float64Array(this.size),this.score=new Float64Array(t.length),this.order=Array.from(t,(o,r)=>r),this.count=Math.min(50,t.length),this.index=new Uint16Array(this.count),this.weight=new Float64Array(this.count)}find(t){let{wanted:e,known:o,score:r,size:i,order:n}=this;e.set(this.rest);for(let u=0;u<t.length;u++){let m=t[u];if(m===0||!this.moves[u])continue;let g=this.shapes[u];for(let v=0;v<i;v++)e[v]+=m*g[v]}let c=0;for(let u=0;u<i;u++)c+=e[u]*e[u];let a=Math.sqrt(c);for(let u=0,m=0;u<r.length;u++){let g=0;for(let v=0;v<i;v++,m++)g+=o[m]*e[v];r[u]=g/(this.length[u]*a)}n.sort((u,m)=>r[m]-r[u]||u-m);let l=1-r[n[0]],h=Math.max(.25*l,1e-4),d=0,f=!1,p=new Float64Array(this.count);for(let u=0;u<this.count;u++)p[u]=Math.exp((l-(1-r[n[u]]))/h),d+=p[u];for(let u=0;u<this.count;u++){let m=p[u]/d;f||=this.index[u]!==n[u]||Math.abs(this.weight[u]-m)>1e-7,this.index[u]=n[u],this.weight[u]=m}return f}};function At(s,t){let e=0,o=1/0;return s.forEach(([r,i],n)=>{let c=(r-t[0])**2+(i-t[1])**2;c<o&&([e,o]=[n,c])}),e}var Tt=64,Kt=.12,G=class{constructor(t,e){this.view=F(t.photo_camera),this.columns=Tt,this.rows=Math.max(8,Math.round(Tt*this.view.height/this.view.width)),this.step=e.reach/32767;let o=t.pose.weights,r=this.#t(e,o);this.mass=this.#o(r),this.cells=Int32Array.from(r.keys()).filter(c=>r[c]>=0);let i=this.cells.length,n=e.part.length;this.rest=new Float32Array(3*i),this.shapes=o.map(()=>new Int16Array(3*i)),this.cells.forEach((c,a)=>{let l=r[c];for(let h=0;h<3;h++)this.rest[3*a+h]=e.positions[3*l+h],this.shapes.forEach((d,f)=>{d[3*a+h]=e.shapes[4*(f*n+l)+h]})}),this.place=new Float32Array(3*i),this.values=new Float32Array(2*r.length),this.before=new Float32Array(2*i),this.#r(o,this.before)}#t(t,e){let{columns:o,rows:r}=this,[i,n]=t.ranges.skin,c=t.part.length,a=[...new Set(t.indices.subarray(i,i+n))],l=Float32Array.from({length:3*a.length},(u,m)=>t.positions[3*a[Math.floor(m/3)]+m%3]);e.forEach((u,m)=>{if(u)for(let g=0;g<a.length;g++){let v=4*(m*c+a[g]);for(let w=0;w<3;w++)l[3*g+w]+=u*this.step*t.shapes[v+w]}});let h=new Float32Array(2*a.length),d=this.#e(l,h),f=new Int32Array(o*r).fill(-1),p=new Float32Array(f.length).fill(1/0);for(let u=0;u<a.length;u++){let m=Math.floor(h[2*u]*o),g=Math.floor(h[2*u+1]*r);if(m<0||g<0||m>=o||g>=r)continue;let v=g*o+m;d[u]<p[v]&&([p[v],f[v]]=[d[u],a[u]])}return f}#e(t,e){let{rotation:o,translation:r,focal:i,center:n,width:c,height:a}=this.view,l=t.length/3,h=new Float32Array(l);for(let d=0;d<l;d++){let[f,p,u]=[t[3*d],t[3*d+1],t[3*d+2]];h[d]=-(o[6]*f+o[7]*p+o[8]*u+r[2]);let m=i/h[d];e[2*d]=(n[0]+(o[0]*f+o[1]*p+o[2]*u+r[0])*m)/c,e[2*d+1]=(n[1]-(o[3]*f+o[4]*p+o[5]*u+r[1])*m)/a}return h}#r(t,e){this.place.set(this.rest),this.shapes.forEach((o,r)=>{let i=t[r]*this.step;if(i!==0)for(let n=0;n<o.length;n++)this.place[n]+=i*o[n]}),this.#e(this.place,e)}#o(t){let{columns:e,rows:o}=this,r=Float32Array.from(t,c=>c>=0?0:1e3),i=(c,a,l)=>{r[a]+l<r[c]&&(r[c]=r[a]+l)};for(let c=0;c<2;c++)for(let a=0;a<r.length;a++){let l=c?r.length-1-a:a,h=l%e,d=(l-h)/e,f=c?1:-1;h+f>=0&&h+f<e&&i(l,l+f,1),d+f>=0&&d+f<o&&(i(l,l+f*e,1),h>0&&i(l,l+f*e-1,1.4),h<e-1&&i(l,l+f*e+1,1.4))}let n=Kt*o;return r.map(c=>c===0?1:Math.min(Math.max(c/n-1,0),1))}at(t){let{cells:e,values:o,before:r}=this,i=new Float32Array(r.length);this.#r(t,i);for(let n=0;n<e.length;n++)o[2*e[n]]=r[2*n]-i[2*n],o[2*e[n]+1]=r[2*n+1]-i[2*n+1];return _t(o,this.mass,this.columns,this.rows)}};function _t(s,t,e,o){if(Math.min(e,o)<2)return s;let[r,i]=[e+1>>1,o+1>>1],n=new Float32Array(2*r*i),c=new Float32Array(r*i);for(let h=0;h<o;h++)for(let d=0;d<e;d++){let f=h*e+d,p=(h>>1)*r+(d>>1);c[p]+=t[f],n[2*p]+=t[f]*s[2*f],n[2*p+1]+=t[f]*s[2*f+1]}for(let h=0;h<c.length;h++){let d=c[h]>0?1/c[h]:0;n[2*h]*=d,n[2*h+1]*=d,c[h]=Math.min(1,c[h])}let a=_t(n,c,r,i),l=new Float32Array(s.length);for(let h=0;h<o;h++)for(let d=0;d<e;d++){let f=h*e+d,p=Math.min(Math.max((d-.5)/2,0),r-1),u=Math.min(Math.max((h-.5)/2,0),i-1),[m,g]=[Math.floor(p),Math.floor(u)],[v,w]=[Math.min(m+1,r-1),Math.min(g+1,i-1)];for(let y=0;y<2;y++){let M=a[2*(g*r+m)+y]*(1-p+m)+a[2*(g*r+v)+y]*(p-m),R=a[2*(w*r+m)+y]*(1-p+m)+a[2*(w*r+v)+y]*(p-m),x=M*(1-u+g)+R*(u-g);l[2*f+y]=t[f]*s[2*f+y]+(1-t[f])*x}}return l}var X=`
vec3 toLinear(vec3 c) {
  return mix(c / 12.92, pow((max(c, 0.04045) + 0.055) / 1.055, vec3(2.4)), step(0.04045, c));
}
vec3 toEncoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(c * 12.92, 1.055 * pow(max(c, 0.0031308), vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}`,ot=`
uniform vec3 light[9], fresh[9]; // the photo's, relative to its camera; another, relative to the head
uniform mat3 photographed; // head to the photo's camera
uniform float exposure; // keeps the face as bright as it was, on average
vec3 shine(vec3 rows[9], vec3 n) { // as bakery/geometry/harmonics.py
  return 0.282095 * rows[0] + 0.488603 * (n.y * rows[1] + n.z * rows[2] + n.x * rows[3])
    + 1.092548 * (n.x * n.y * rows[4] + n.y * n.z * rows[5] + n.x * n.z * rows[7])
    + 0.315392 * (3.0 * n.z * n.z - 1.0) * rows[6] + 0.546274 * (n.x * n.x - n.y * n.y) * rows[8];
}
float luma(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
vec3 relit(vec3 n) { // what the photo's colours are multiplied by
  float was = luma(shine(light, photographed * n)) / max(luma(shine(light, vec3(0.0, 0.0, 1.0))), 1e-4);
  return exposure * max(shine(fresh, n), 0.02) / clamp(was, 0.45, 1.5);
}`,U=`
void main() {
  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(corner, 0.0, 1.0);
}`,bt=`
precision highp float;
uniform sampler2D atlas;
uniform int first, columns, count, side;
out vec4 mask;
float cell(int number) {
  if (number >= count) return 0.0;
  ivec2 corner = ivec2(number % columns, number / columns) * side;
  return texelFetch(atlas, corner + ivec2(gl_FragCoord.xy), 0).r;
}
void main() { mask = vec4(cell(first), cell(first + 1), cell(first + 2), cell(first + 3)); }`,Rt=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray masks;
uniform int groups;
uniform int group[13];
uniform vec4 product[104]; // a_e^k a_e^t, four expressions each, eight keys a group
layout(location = 0) out vec4 low;
layout(location = 1) out vec4 high;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  low = vec4(0.0);
  high = vec4(0.0);
  for (int g = 0; g < groups; g++) {
    vec4 a = texelFetch(masks, ivec3(place, group[g]), 0);
    int k = 8 * group[g];
    low += vec4(dot(a, product[k]), dot(a, product[k + 1]), dot(a, product[k + 2]), dot(a, product[k + 3]));
    high += vec4(dot(a, product[k + 4]), dot(a, product[k + 5]), dot(a, product[k + 6]), dot(a, product[k + 7]));
  }
  float total = dot(low, vec4(1.0)) + dot(high, vec4(1.0));
  float scale = 1.0 / max(1.0, total); // w_0 + sum is 1 or, where w_0 is 0, the sum
  low *= scale;
  high *= scale;
}`,Ft=`
precision highp float;
precision highp sampler2DArray;
uniform sampler2DArray faces;
uniform sampler2D low, high, hair;
uniform int keys;
uniform bool hairy;
out vec4 color;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(faces, 0).xy);
  vec4 one = texture(low, uv), two = texture(high, uv);
  float w[8] = float[](one.x, one.y, one.z, one.w, two.x, two.y, two.z, two.w);
  float rest = 1.0 - dot(one, vec4(1.0)) - dot(two, vec4(1.0));
  vec3 c = rest * texelFetch(faces, ivec3(place, 0), 0).rgb;
  for (int k = 0; k < keys; k++)
    if (w[k] > 1e-4) c += w[k] * texelFetch(faces, ivec3(place, k + 1), 0).rgb;
  if (hairy) {
    vec4 h = texelFetch(hair, place, 0);
    c = c * (1.0 - h.a) + h.rgb * h.a;
  }
  color = vec4(c, 1.0);
}`,kt=`
precision highp float;
uniform sampler2D mouths;
uniform int columns, count;
uniform ivec2 cell;
uniform vec2 neighbour[50]; // index, weight
out vec4 median;
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 seen[50];
  float total = 0.0;
  for (int n = 0; n < count; n++) {
    int index = int(neighbour[n].x);
    ivec2 corner = ivec2(index % columns, index / columns) * cell;
    seen[n] = floor(texelFetch(mouths, corner + place, 0).rgb * 255.0 + 0.5);
    total += neighbour[n].y;
  }
  vec3 value = vec3(0.0);
  for (float bit = 128.0; bit >= 1.0; bit *= 0.5) {
    vec3 most = value + bit - 1.0; // with this bit 0
    vec3 reached = vec3(0.0);
    for (int n = 0; n < count; n++) reached += neighbour[n].y * vec3(lessThanEqual(seen[n], most));
    value += bit * vec3(lessThan(reached, vec3(0.5 * total)));
  }
  median = vec4(value / 255.0, 1.0);
}`,Mt=`
precision highp float;
precision highp isampler2DArray;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
layout(location = 3) in uint piece;
uniform mat4 view, projection;
uniform isampler2DArray shapes;
uniform int count;
uniform vec2 moving[52]; // shape, millimetres of a step
uniform vec2 cards; // how much of the left and of the right eye's lashes shows
const float BEHIND = 8.0; // mm
flat out float shows;
out vec2 uv;
out vec3 bent;
out vec2 place; // mm: height at rest and depth
flat out uint part;
void main() {
  vec3 p = position;
  ivec2 cell = ivec2(gl_VertexID & 255, gl_VertexID >> 8);
  for (int k = 0; k < count; k++)
    p += moving[k].y * vec3(texelFetch(shapes, ivec3(cell, int(moving[k].x)), 0).xyz);
  uv = texel;
  part = piece;
  bent = normal.xyz;
  place = vec2(position.y, p.z);
  shows = position.x < 0.0 ? cards.y : cards.x;
  vec4 seen = view * vec4(p, 1.0);
  gl_Position = projection * seen;
  if (piece == 3u) { // farther, for the tongue; render.BEHIND is the reference
    vec4 behind = projection * (seen - vec4(0.0, 0.0, BEHIND, 0.0));
    gl_Position.z = behind.z / behind.w * gl_Position.w;
  }
}`,Lt=`
precision highp float;
precision highp sampler2DArray;
in vec2 uv;
in vec3 bent;
in vec2 place;
flat in float shows;
flat in uint part;
uniform sampler2D face, mouth, gaze, coverage, photo, flow, hair;
uniform sampler2DArray masks;
uniform vec4 places[3]; // rectangles of eye_cap_left, eye_cap_right, mouth_sheet in the atlas
uniform ivec2 eyeCell, eyeCorner;
uniform vec2 slide; // of the eyes' picture, beyond its own direction
uniform int layer, shown;
uniform bool lit, inPhoto, soft, geometry;
uniform float lips; // mm: how far forward they are at rest
uniform vec2 fade; // mm, where the bust ends and where it is whole
uniform vec4 frame; // of the photo: left, top, width, height in pixels of the target
uniform float tall; // pixels of the target
uniform float scale; // pixels a millimetre
const float SHADE = 1.4; // mm
out vec4 color;
${X}
${ot}
vec3 four(sampler2D map, ivec2 corner, ivec2 size, vec2 local) {
  vec2 p = local * vec2(size) - 0.5;
  vec2 low = floor(p);
  vec2 t = p - low;
  ivec2 a = clamp(ivec2(low), ivec2(0), size - 1), b = clamp(ivec2(low) + 1, ivec2(0), size - 1);
  vec3 aa = toLinear(texelFetch(map, corner + a, 0).rgb);
  vec3 ba = toLinear(texelFetch(map, corner + ivec2(b.x, a.y), 0).rgb);
  vec3 ab = toLinear(texelFetch(map, corner + ivec2(a.x, b.y), 0).rgb);
  vec3 bb = toLinear(texelFetch(map, corner + b, 0).rgb);
  return mix(mix(aa, ba, t.x), mix(ab, bb, t.x), t.y);
}
// As the reference reads it: no mipmaps, colour multiplied by alpha before it is mixed.
vec4 exactCard(vec2 uv) {
  ivec2 size = textureSize(hair, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(hair, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(one.rgb * one.a, one.a);
  }
  return vec4(sum.rgb / max(sum.a, 1e-6), sum.a);
}
float shade(float behind) { return 0.05 + 0.6 * exp(-max(behind, 0.0) / 13.0); }
vec3 heat(float x) {
  return clamp(vec3(1.9 * x, 2.4 * x - 0.7, 0.25 + 1.6 * x - 2.6 * x * x + 1.2 * x * x * x), 0.0, 1.0);
}
void main() {
  if (part > 7u) { // lashes and tear line
    vec4 card = soft ? texture(hair, uv) : exactCard(uv);
    color = vec4(toEncoded(card.rgb), card.a * shows);
    return;
  }
  vec3 c;
  float known = 1.0;
  if (part == 3u) {
    vec2 local = (uv - places[2].xy) / places[2].zw;
    c = four(mouth, ivec2(0), textureSize(mouth, 0), local);
    if (soft) { // the lips' shade, so that the sheet does not end at a line
      vec2 away = min(local, 1.0 - local) / max(fwidth(local), 1e-5) / scale; // mm
      c *= mix(vec3(0.42, 0.34, 0.33), vec3(1.0), smoothstep(0.0, SHADE, min(away.x, away.y)));
    }
  } else if (part < 2u) {
    vec4 box = places[int(part)];
    c = four(gaze, eyeCorner + ivec2(int(part), 0) * eyeCell, eyeCell, (uv - box.xy) / box.zw - slide);
  } else {
    c = texture(face, uv).rgb;
    if (part == 2u) known = texture(coverage, uv).r;
    else if (geometry && part != 5u) c *= shade(lips - place.y) * vec3(1.0, 0.93, 0.9); // light falls off behind the lips
  }
  if (layer == 1) {
    ivec3 size = textureSize(masks, 0);
    float a = texture(masks, vec3(uv, float(shown / 4)))[shown % 4];
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? toLinear(heat(a)) * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 2) {
    int kind = int(texelFetch(coverage, ivec2(uv * vec2(textureSize(coverage, 0))), 0).g * 4.25 + 0.5);
    vec3 tint = kind == 1 ? vec3(0.10, 0.55, 0.25) : kind == 2 ? vec3(0.10, 0.35, 0.75)
      : kind == 3 ? vec3(0.85, 0.45, 0.05) : kind == 4 ? vec3(0.65, 0.10, 0.45) : vec3(0.2);
    float gray = dot(c, vec3(0.2126, 0.7152, 0.0722));
    c = part == 2u ? tint * (0.25 + 1.5 * gray) : vec3(gray);
  } else if (layer == 3) {
    vec2 line = abs(fract(uv * 32.0) - 0.5);
    float grid = smoothstep(0.46, 0.48, max(line.x, line.y));
    float check = mod(floor(uv.x * 32.0) + floor(uv.y * 32.0), 2.0);
    c = mix(vec3(uv, 0.35) * (0.55 + 0.35 * check), vec3(0.9), grid * 0.6);
  } else if (lit) {
    c *= relit(normalize(bent));
  }
  float alpha = 1.0;
  if (inPhoto) {
    vec2 here = (vec2(gl_FragCoord.x, tall - gl_FragCoord.y) - frame.xy) / frame.zw;
    vec3 around = texture(photo, here + texture(flow, here).xy).rgb;
    if (layer == 0) c = mix(around, c, known);
  } else if (soft) {
    alpha *= smoothstep(fade.x, fade.y, place.x);
  }
  color = vec4(toEncoded(c), alpha);
}`,Ut=`
precision highp float;
uniform sampler2D photo, flow;
uniform vec4 frame;
uniform vec2 size;
uniform bool inPhoto, plain;
uniform vec3 wall, floorTint;
out vec4 color;
${X}
float noise(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(0.06711056, 0.00583715)))); }
void main() {
  vec2 pixel = vec2(gl_FragCoord.x, size.y - gl_FragCoord.y);
  if (plain) {
    color = vec4(toEncoded(vec3(0.18)), 1.0);
    return;
  }
  vec2 unit = pixel / size;
  vec2 away = (unit - vec2(0.5, 0.42)) * vec2(size.x / size.y, 1.0);
  vec3 c = mix(wall, floorTint, smoothstep(0.05, 1.0, length(away) * 1.15));
  vec3 encoded = c + (noise(gl_FragCoord.xy) - 0.5) / 255.0; // against bands
  if (inPhoto) {
    vec2 here = (pixel - frame.xy) / frame.zw;
    float far = max(max(-here.x, here.x - 1.0), max(-here.y, here.y - 1.0));
    vec3 around = textureLod(photo, clamp(here, vec2(0.02), vec2(0.98)), 6.0).rgb * 0.5
      + textureLod(photo, clamp(here, vec2(0.1), vec2(0.9)), 8.0).rgb * 0.5;
    encoded = toEncoded(around * mix(0.34, 0.12, smoothstep(0.0, 0.6, far)))
      + (noise(gl_FragCoord.xy) - 0.5) / 255.0;
    if (all(greaterThanEqual(here, vec2(0.0))) && all(lessThan(here, vec2(1.0))))
      encoded = toEncoded(texture(photo, here + texture(flow, here).xy).rgb);
  }
  color = vec4(encoded, 1.0);
}`;var qt=240,Dt=[420,160],Zt=s=>`
precision highp float;
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 normal;
layout(location = 2) in vec2 texel;
uniform mat4 view, projection;
uniform bool whole;
uniform vec2 fade; // mm, where the bust ends and where it is whole
${s==="lit"?`${ot}
out vec3 tint;`:""}
out vec2 uv;
out float shows;
void main() {
  uv = texel;
  shows = whole ? 1.0 : smoothstep(fade.x, fade.y, position.y);
  ${s==="lit"?"tint = relit(normalize(normal.xyz));":""}
  gl_Position = projection * (view * vec4(position, 1.0));
}`,Jt=s=>`
precision highp float;
${s==="lit"?"in vec3 tint;":""}
in vec2 uv;
in float shows;
uniform sampler2D atlas;
uniform float least; // alpha: 1 for the cap, which is opaque
out vec4 color;
${X}
vec4 exact() {
  ivec2 size = textureSize(atlas, 0);
  vec2 p = uv * vec2(size) - 0.5;
  ivec2 low = ivec2(floor(p));
  vec2 t = p - floor(p);
  vec4 sum = vec4(0.0);
  for (int k = 0; k < 4; k++) {
    ivec2 step = ivec2(k & 1, k >> 1);
    vec4 one = texelFetch(atlas, clamp(low + step, ivec2(0), size - 1), 0);
    vec2 share = mix(1.0 - t, t, vec2(step));
    sum += share.x * share.y * vec4(toLinear(one.rgb) * one.a, one.a);
  }
  return vec4(toEncoded(sum.rgb / max(sum.a, 1e-3)), sum.a);
}
void main() {
  color = ${s==="exact"?"exact()":"texture(atlas, uv)"};
  color.a = max(color.a, least) * shows;
  if (color.a < 0.002) discard;
  ${s==="lit"?"color.rgb = toEncoded(toLinear(color.rgb) * tint);":""}
}`,rt=(s,t)=>new b(s,Zt(t),Jt(t)),H=class{#t;#e;#r;constructor(t,e){this.#t=t,this.#e=e.levels.map(r=>r&&{...r,middles:Qt(e,r),sorted:r.cards.slice(),seen:[]}),this.#r=t.createVertexArray(),t.bindVertexArray(this.#r);let o=(r,i,n,c,a)=>{t.bindBuffer(t.ARRAY_BUFFER,t.createBuffer()),t.bufferData(t.ARRAY_BUFFER,i,t.STATIC_DRAW),t.enableVertexAttribArray(r),t.vertexAttribPointer(r,n,c,a,0,0)};o(0,e.positions,3,t.FLOAT,!1),o(1,e.normals,4,t.BYTE,!0),o(2,e.uv,2,t.FLOAT,!1),t.bindBuffer(t.ELEMENT_ARRAY_BUFFER,t.createBuffer()),t.bindVertexArray(null),this.held=null}levelFor(t){let e=qt*t.focal/-t.translation[2],o=globalThis.matchMedia?.("(pointer: coarse)").matches;return Math.min(Dt.filter(r=>e<r).length+Number(o??!1),Dt.length)}#o(t){for(let e=Math.min(Math.max(t,0),this.#e.length-1);e>=0;e--)if(this.#e[e])return this.#e[e];return this.#e.find(Boolean)}#s(t,e){let o=this.#t,r=e.slice(6),i=r.some((n,c)=>n!==t.seen[c]);if(i){let{middles:n,starts:c,cards:a,sorted:l}=t,h=Float64Array.from(c.keys(),p=>n[3*p]*r[0]+n[3*p+1]*r[1]+n[3*p+2]*r[2]),d=Array.from(c.keys()).sort((p,u)=>h[p]-h[u]),f=0;for(let p of d){let u=a.subarray(c[p],c[p+1]??a.length);l.set(u,f),f+=u.length}t.seen=r}(i||this.held!==t)&&(o.bufferData(o.ELEMENT_ARRAY_BUFFER,4*(t.cap.length+t.sorted.length),o.DYNAMIC_DRAW),o.bufferSubData(o.ELEMENT_ARRAY_BUFFER,0,t.cap),o.bufferSubData(o.ELEMENT_ARRAY_BUFFER,4*t.cap.length,t.sorted),this.held=t)}draw(t,e,o){let r=this.#t,i=this.#o(e),n=i?.[t].length;return n?(r.bindVertexArray(this.#r),this.#s(i,o),r.drawElements(r.TRIANGLES,n,r.UNSIGNED_INT,t==="cap"?0:4*i.cap.length),r.bindVertexArray(null),1):0}};function Qt({positions:s},{cards:t,starts:e}){let o=new Float64Array(3*e.length);return e.forEach((r,i)=>{let n=e[i+1]??t.length;for(let c=r;c<n;c++)for(let a=0;a<3;a++)o[3*i+a]+=s[3*t[c]+a]/(n-r)}),o}var $=256;async function it(s){let{atlases:t,keys:e}=s.description,r=["neutral",...e.map(n=>n.name),"gaze","mouths","masks","coverage","hair","hair_cards","photo"].filter(n=>Object.hasOwn(t,n)),i=await Promise.all(r.map(n=>Et(s,t[n])));return Object.fromEntries(r.map((n,c)=>[n,i[c]]))}var Y=class{constructor(t,e,o,r){this.gl=t;let i=t.getParameter(t.MAX_TEXTURE_SIZE);for(let[n,c]of Object.entries(o))if(Math.max(c.width,c.height)>i)throw new E(`${n}: ${c.width} x ${c.height} texels, this device takes ${i}; bake with --preset mobile`);t.pixelStorei(t.UNPACK_PREMULTIPLY_ALPHA_WEBGL,!1),t.pixelStorei(t.UNPACK_COLORSPACE_CONVERSION_WEBGL,t.NONE),t.pixelStorei(t.UNPACK_FLIP_Y_WEBGL,!1),this.side=o.neutral.width,this.faces=this.#t(["neutral",...e.keys.map(n=>n.name)].map(n=>o[n])),this.mouths=this.#e(o.mouths,t.RGBA8),this.gaze=this.#e(o.gaze,t.RGBA8),this.coverage=this.#e(o.coverage??nt(255),t.RGBA8,!0),this.hairy=!!o.hair,this.hair=this.#e(o.hair??nt(0),t.SRGB8_ALPHA8,!0,this.hairy),this.locks=r.hair&&o.hair_cards?this.#e(o.hair_cards,t.RGBA8,!0,!0):null,this.locks&&t.texParameteri(t.TEXTURE_2D,t.TEXTURE_MIN_FILTER,t.LINEAR_MIPMAP_NEAREST),this.photo=this.#e(o.photo??nt(0),t.SRGB8_ALPHA8,!0,!!o.photo),this.masks=this.#r(o.masks,e.atlases.masks),this.#o(r)}#t(t){let{gl:e,side:o}=this,r=L(e,{format:e.SRGB8_ALPHA8,width:o,height:o,layers:t.length});return t.forEach((i,n)=>{if(i.width!==o||i.height!==o)throw new E("face pictures differ in size; bake the bundle again");e.texSubImage3D(e.TEXTURE_2D_ARRAY,0,0,0,n,o,o,1,e.RGBA,e.UNSIGNED_BYTE,i)}),r}#e(t,e,o=!1,r=!1){let{gl:i}=this,n=i.createTexture();i.bindTexture(i.TEXTURE_2D,n);let{width:c,height:a}=t,l=r?Math.floor(Math.log2(Math.max(c,a)))+1:1;i.texStorage2D(i.TEXTURE_2D,l,e,c,a),t.data?i.texSubImage2D(i.TEXTURE_2D,0,0,0,c,a,i.RGBA,i.UNSIGNED_BYTE,t.data):i.texSubImage2D(i.TEXTURE_2D,0,0,0,i.RGBA,i.UNSIGNED_BYTE,t),r&&i.generateMipmap(i.TEXTURE_2D);let h=o?i.LINEAR:i.NEAREST;return i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MIN_FILTER,r?i.LINEAR_MIPMAP_LINEAR:h),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_MAG_FILTER,h),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_S,i.CLAMP_TO_EDGE),i.texParameteri(i.TEXTURE_2D,i.TEXTURE_WRAP_T,i.CLAMP_TO_EDGE),n}#r(t,e){let{gl:o}=this,r=t.width/e.columns,i=Math.ceil(A/4),n=this.#e(t,o.RGBA8),c=L(o,{format:o.RGBA8,width:r,height:r,layers:i,linear:!0}),a=new b(o,U,bt),l=o.createFramebuffer();o.bindFramebuffer(o.FRAMEBUFFER,l),o.viewport(0,0,r,r),o.disable(o.DEPTH_TEST),o.disable(o.BLEND),o.disable(o.CULL_FACE),a.use(),a.textures({atlas:[o.TEXTURE_2D,n]}),o.uniform1i(a.at("columns"),e.columns),o.uniform1i(a.at("count"),A),o.uniform1i(a.at("side"),r);for(let h=0;h<i;h++)o.framebufferTextureLayer(o.FRAMEBUFFER,o.COLOR_ATTACHMENT0,c,0,h),o.uniform1i(a.at("first"),4*h),o.drawArrays(o.TRIANGLES,0,3);return o.bindFramebuffer(o.FRAMEBUFFER,null),o.deleteFramebuffer(l),o.deleteTexture(n),o.deleteProgram(a.handle),this.maskSide=r,c}#o(t){let{gl:e}=this,o=t.part.length;this.array=e.createVertexArray(),e.bindVertexArray(this.array);let r=(l,h,d,f,p)=>{e.bindBuffer(e.ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ARRAY_BUFFER,h,e.STATIC_DRAW),e.enableVertexAttribArray(l),f===e.UNSIGNED_BYTE?e.vertexAttribIPointer(l,d,f,0,0):e.vertexAttribPointer(l,d,f,p,0,0)};r(0,t.positions,3,e.FLOAT,!1),r(1,t.normals,4,e.BYTE,!0),r(2,t.uv,2,e.FLOAT,!1),r(3,t.part,1,e.UNSIGNED_BYTE,!1),e.bindBuffer(e.ELEMENT_ARRAY_BUFFER,e.createBuffer()),e.bufferData(e.ELEMENT_ARRAY_BUFFER,t.indices,e.STATIC_DRAW),e.bindVertexArray(null);let i=Math.ceil(o/$);this.shapes=L(e,{format:e.RGBA16I,width:$,height:i,layers:A});let n=new Int16Array(4*$*i);for(let l=0;l<A;l++)n.set(t.shapes.subarray(4*l*o,4*(l+1)*o)),e.texSubImage3D(e.TEXTURE_2D_ARRAY,0,0,0,l,$,i,1,e.RGBA_INTEGER,e.SHORT,n);this.step=t.reach/32767;let c=l=>l.filter(h=>t.ranges[h]).map(h=>t.ranges[h]),a=S.filter(l=>!B.includes(l));this.runs={image:st(c(et)),geometry:st(c(a.filter(l=>l!=="mouth_sheet"))),cards:this.hairy?st(c(B)):[]}}};function st(s){let t=[];for(let[e,o]of s){let r=t.at(-1);r&&r[0]+r[1]===e?r[1]+=o:t.push([e,o])}return t}var nt=s=>({width:1,height:1,data:new Uint8Array(4).fill(s)});function St(s,t,e,o){let r=s.getExtension("EXT_color_buffer_float")||s.getExtension("EXT_color_buffer_half_float"),i=l=>new k(s,{format:l,width:t,height:t,linear:!0}),n=l=>new k(s,{format:l,width:e,height:e,count:2,linear:!0}),c=r&&{face:i(s.RGBA16F),weights:n(s.RGBA16F)};(!c||!c.face.complete||!c.weights.complete)&&(c={face:i(s.SRGB8_ALPHA8),weights:n(s.RGBA8)});let a=new k(s,{format:s.RGBA8,width:o[0],height:o[1]});return{...c,mouth:a}}var te=["color","mask","coverage","uv"],at=-40,ee=74,Nt=.25,oe=[8,32],re=[.2,.75];function ct(s){return{weights:new b(s,U,Rt),compose:new b(s,U,Ft),median:new b(s,U,kt),backdrop:new b(s,U,Ut),head:new b(s,Mt,Lt),hair:{plain:rt(s,"plain")}}}var V=class{#t;#e;#r;#o;#s;#n=null;#i=null;#h=null;#c=new Float32Array(416);#l=new Float32Array(100);#f=new Float32Array(104);#a;#m;#p;constructor(t,e,o,r,i){this.#t=t,this.#e=e,this.#r=o,this.#o=i,this.#s=new Y(t,e,r,o),this.reach=[0,0],this.#s.locks&&(this.#n=new H(t,o.hair),this.reach=ie(o.hair,e));let n=c=>{let{columns:a,rows:l}=e.atlases[c];return[r[c].width/a,r[c].height/l]};this.mouthCell=n("mouths"),this.gazeCell=n("gaze"),this.targets=St(t,this.#s.side,this.#s.maskSide,this.mouthCell),this.bottom=o.positions.reduce((c,a,l)=>l%3===1?Math.min(c,a):c,0),this.lips=ae(o,"mouth_sheet"),this.#a=W(e.photo_camera.rotation),this.#m=ne(e.light,o,this.#a),this.#p=["Left","Right"].map(c=>e.expressions.indexOf("eyeBlink"+c)),this.stats={drawCalls:0,uniformBytes:0,milliseconds:0,medians:0,compositions:0,hairLevel:null}}start(){Object.assign(this.stats,{drawCalls:0,uniformBytes:0,medians:0,compositions:0,hairLevel:null});let t=this.#t;t.disable(t.DEPTH_TEST),t.disable(t.BLEND),t.disable(t.CULL_FACE)}compose(t,e,o){let r=this.#t,{weights:i,compose:n}=this.#o,c=this.#s,{keys:a}=this.#e,l=o&&c.hairy,h=[];this.#c.fill(0);for(let p=0;p<t.length;p++){let u=e?t[p]:0;if(u===0||!a.some(g=>g.weights[p]))continue;let m=p>>2;h.at(-1)!==m&&h.push(m),a.forEach((g,v)=>{this.#c[4*(8*m+v)+(p&3)]=g.weights[p]*u})}this.targets.weights.bind(),i.use(),i.textures({masks:[r.TEXTURE_2D_ARRAY,c.masks]}),r.uniform1i(i.at("groups"),h.length),h.length&&r.uniform1iv(i.at("group"),h),r.uniform4fv(i.at("product"),this.#c),this.#u(4+4*h.length+this.#c.byteLength),this.targets.face.bind(),n.use();let[d,f]=this.targets.weights.textures;n.textures({faces:[r.TEXTURE_2D_ARRAY,c.faces],low:[r.TEXTURE_2D,d],high:[r.TEXTURE_2D,f],hair:[r.TEXTURE_2D,c.hair]}),r.uniform1i(n.at("keys"),h.length?a.length:0),r.uniform1i(n.at("hairy"),Number(l)),this.#u(8),this.stats.compositions++}median(t){let e=this.#t,o=this.#o.median;for(let r=0;r<t.count;r++)this.#l[2*r]=t.index[r],this.#l[2*r+1]=t.weight[r];this.targets.mouth.bind(),o.use(),o.textures({mouths:[e.TEXTURE_2D,this.#s.mouths]}),e.uniform1i(o.at("columns"),this.#e.atlases.mouths.columns),e.uniform1i(o.at("count"),t.count),e.uniform2i(o.at("cell"),this.mouthCell[0],this.mouthCell[1]),e.uniform2fv(o.at("neighbour"),this.#l),this.#u(16+this.#l.byteLength),this.stats.medians++}pull(t){let e=this.#t;this.#i??=new G(this.#e,this.#r);let{columns:o,rows:r}=this.#i;this.#h??=L(e,{format:e.RG16F,width:o,height:r,linear:!0}),e.bindTexture(e.TEXTURE_2D,this.#h);let i=this.#i.at(t);e.texSubImage2D(e.TEXTURE_2D,0,0,0,o,r,e.RG,e.FLOAT,i)}#w(t,e){let[o,r]=[t.rotation,this.#a].map(c=>c.slice(6)),i=Math.min(o[0]*r[0]+o[1]*r[1]+o[2]*r[2],1),n=It(oe,Math.acos(i)*180/Math.PI);return this.#p.map(c=>Nt+(1-Nt)*Math.max(n,It(re,e[c])))}#d(t){let e=this.#t;for(let[o,r]of t)e.drawElements(e.TRIANGLES,r,e.UNSIGNED_SHORT,2*o),this.stats.drawCalls++}#u(t){this.#t.drawArrays(this.#t.TRIANGLES,0,3),this.stats.drawCalls++,this.stats.uniformBytes+=t}picture(t,{weights:e,gaze:o,options:r,inPhoto:i,shown:n},c){let a=this.#t,l=this.#e,h=this.#s,{backdrop:d,head:f}=this.#o;a.disable(a.BLEND),a.disable(a.CULL_FACE),a.disable(a.DEPTH_TEST);let p=t.focal/l.photo_camera.focal,u=[t.center[0]-l.photo_camera.center[0]*p,t.center[1]-l.photo_camera.center[1]*p,l.photo_camera.width*p,l.photo_camera.height*p],m=i?this.#h:h.hair;d.use(),d.textures({photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m]}),a.uniform4fv(d.at("frame"),u),a.uniform2f(d.at("size"),t.width,t.height),a.uniform1i(d.at("inPhoto"),Number(i)),a.uniform1i(d.at("plain"),Number(c&&!i)),a.uniform3fv(d.at("wall"),r.wall),a.uniform3fv(d.at("floorTint"),r.floor),this.#u(56),a.enable(a.DEPTH_TEST),a.clear(a.DEPTH_BUFFER_BIT),a.enable(a.CULL_FACE),c||(a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA));let g=this.#n&&r.hair&&r.layer==="color";g&&(a.disable(a.CULL_FACE),this.#g("cap",t,r,i,c),a.enable(a.CULL_FACE)),f.use(),f.textures({face:[a.TEXTURE_2D,this.targets.face.textures[0]],mouth:[a.TEXTURE_2D,this.targets.mouth.textures[0]],gaze:[a.TEXTURE_2D,h.gaze],coverage:[a.TEXTURE_2D,h.coverage],photo:[a.TEXTURE_2D,h.photo],flow:[a.TEXTURE_2D,m],hair:[a.TEXTURE_2D,h.hair],masks:[a.TEXTURE_2D_ARRAY,h.masks],shapes:[a.TEXTURE_2D_ARRAY,h.shapes]});let v=0;for(let I=0;I<e.length;I++)e[I]!==0&&(this.#f[2*v]=I,this.#f[2*v+++1]=e[I]*h.step);let w=At(l.gaze,o),y=2*l.eyes.cap,{columns:M}=l.atlases.gaze,[R,x]=this.gazeCell;a.uniformMatrix4fv(f.at("view"),!1,q(t)),a.uniformMatrix4fv(f.at("projection"),!1,Z(t)),a.uniform1i(f.at("count"),v),v&&a.uniform2fv(f.at("moving"),this.#f.subarray(0,2*v));let{uv:N}=l;a.uniform4fv(f.at("places"),[...N.eye_cap_left,...N.eye_cap_right,...N.mouth_sheet]),a.uniform2i(f.at("eyeCell"),R/2,x),a.uniform2i(f.at("eyeCorner"),w%M*R,Math.floor(w/M)*x),a.uniform2f(f.at("slide"),(o[0]-l.gaze[w][0])/y,(l.gaze[w][1]-o[1])/y),a.uniform1i(f.at("layer"),te.indexOf(r.layer)),a.uniform1i(f.at("shown"),n),a.uniform1i(f.at("inPhoto"),Number(i)),a.uniform1i(f.at("soft"),+!c),a.uniform1f(f.at("scale"),-t.focal/t.translation[2]),this.#v(f,r,i||c),a.uniform2fv(f.at("cards"),this.#w(t,e)),a.uniform1f(f.at("lips"),this.lips),a.uniform1i(f.at("geometry"),+(r.mouth==="geometry")),a.uniform2fv(f.at("fade"),this.#E),a.uniform4fv(f.at("frame"),u),a.uniform1f(f.at("tall"),t.height),this.stats.uniformBytes+=128+8*v+48+24+24+256+8+28+8,a.bindVertexArray(h.array),this.#d(r.mouth==="geometry"?h.runs.geometry:h.runs.image),r.layer==="color"&&(a.disable(a.CULL_FACE),a.enable(a.BLEND),a.blendFunc(a.SRC_ALPHA,a.ONE_MINUS_SRC_ALPHA),a.depthMask(!1),this.#d(h.runs.cards),g&&this.#g("cards",t,r,i,c),a.depthMask(!0)),a.bindVertexArray(null)}#g(t,e,o,r,i){let n=this.#t,c=i?"exact":o.light&&!r?"lit":"plain",a=this.#o.hair[c]??=rt(n,c);a.use(),a.textures({atlas:[n.TEXTURE_2D,this.#s.locks]}),n.uniformMatrix4fv(a.at("view"),!1,q(e)),n.uniformMatrix4fv(a.at("projection"),!1,Z(e)),n.uniform1f(a.at("least"),+(t==="cap")),n.uniform1i(a.at("whole"),Number(r||i)),n.uniform2fv(a.at("fade"),this.#E),c==="lit"&&this.#v(a,o,!1);let l=o.hairLevel??(i?0:this.#n.levelFor(e));this.stats.drawCalls+=this.#n.draw(t,l,e.rotation),this.stats.hairLevel=l,this.stats.uniformBytes+=408}#v(t,{light:e},o){let r=this.#t;r.uniform1i(t.at("lit"),Number(e&&!o)),r.uniform3fv(t.at("light"),this.#e.light.flat()),r.uniform3fv(t.at("fresh"),se(e??this.#e.light)),r.uniformMatrix3fv(t.at("photographed"),!0,this.#a),r.uniform1f(t.at("exposure"),this.#m)}get#E(){return[this.bottom+2,this.bottom+ee]}};function It(s,t){let[e,o]=s,r=Math.min(Math.max((t-e)/(o-e),0),1);return r*r*(3-2*r)}function se(s){let t=Array.isArray(s)?s.flat():[];if(t.length!==27||!t.every(Number.isFinite))throw new E("options.light: give nine rows of three numbers, or null");return t}function ne(s,t,e){let o=(a,l,h)=>[.282095,.488603*l,.488603*h,.488603*a,1.092548*a*l,1.092548*l*h,.315392*(3*h*h-1),1.092548*a*h,.546274*(a*a-l*l)].reduce((f,p,u)=>f+p*(.2126*s[u][0]+.7152*s[u][1]+.0722*s[u][2]),0),r=Math.max(o(0,0,1),1e-4),i=S.indexOf("skin"),n=0,c=0;for(let a=0;a<t.part.length;a++){let l=[0,1,2].map(p=>t.normals[4*a+p]/127),[h,d,f]=[0,3,6].map(p=>e[p]*l[0]+e[p+1]*l[1]+e[p+2]*l[2]);t.part[a]!==i||f<.3||(n+=1/Math.min(Math.max(o(h,d,f)/r,.45),1.5),c++)}return c?c/n:1}function ie({positions:s},t){let e=F(t.front_camera),[o,r]=[0,0];for(let i=0;i<s.length;i+=3){let[n,c,a]=s.subarray(i,i+3),[,l,h]=C(e,[n,c,a]);o=Math.max(o,e.height/2-l),r=Math.max(r,Math.hypot(n,a-at)*e.focal/h)}return[o,r]}function ae(s,t){let[e,o]=s.ranges[t],r=0;for(let i=e;i<e+o;i++)r+=s.positions[3*s.indices[i]+2];return r/o}var Pt=.48,ce=[0,-75,-45],We=[32,24],Ot=[35,30];async function Ke(s,{canvas:t,antialias:e=!0}){let o=t.getContext("webgl2",{antialias:e,alpha:!1,powerPreference:"high-performance"});if(!o)throw new E("this browser has no WebGL 2; update it, or turn hardware acceleration on");let r=typeof s=="string"?await dt(s):s;gt(r.description);let i=ct(o),[n,c]=await Promise.all([it(r),r.file(J(r.description))]);return new ht(o,r,n,yt(c),i)}var ht=class{#t;#e;#r;#o;#s=!1;#n=!0;#i=!0;#h="";constructor(t,e,o,r,i){this.#t=t,this.#e=e,this.#r=r;let n=e.description;this.about=n,this.expressions=n.expressions,this.canvas=t.canvas,this.weights=new Float32Array(n.expressions.length),this.index=new Map(n.expressions.map((c,a)=>[c,a])),this.hasPhoto=!!n.atlases.photo,this.hasHair=!!(n.atlases.hair||n.atlases.hair_cards),this.options={stage:"studio",dynamic:!0,hair:!0,hairLevel:null,mouth:"image",light:null,layer:"color",layerExpression:"jawOpen",wall:[.36,.37,.39],floor:[.13,.135,.15]},this.orbit={yaw:0,pitch:0,zoom:1,shift:[0,0]},this.head=[0,0,0],this.direction=null,this.mouths=new z(n.mouths,n.lips),this.#c(o,i),this.canvas.addEventListener("webglcontextlost",c=>{c.preventDefault(),this.#s=!0}),this.canvas.addEventListener("webglcontextrestored",()=>this.#l())}#c(t,e){this.#o=new V(this.#t,this.about,this.#r,t,e),this.stats=this.#o.stats,Object.values(t).forEach(o=>o.close()),this.mouths.weight.fill(-1),this.#n=this.#i=!0}async#l(){let t=ct(this.#t);this.#c(await it(this.#e),t),this.#s=!1,this.canvas.dispatchEvent(new Event("avatarrestored"))}set(t){for(let[e,o]of Object.entries(t)){let r=this.index.get(e);if(r===void 0)throw new E(`no expression '${String(e).slice(0,40)}'`);if(!Number.isFinite(o))throw new E(`${e}: ${o} is no weight`);let i=Math.fround(Math.min(Math.max(o,0),1));this.weights[r]!==i&&(this.weights[r]=i,e.startsWith("eyeLook")&&(this.direction=null),this.#n=this.#i=!0)}return this}get(t){return this.weights[this.index.get(t)]}reset(){return this.weights.fill(0),this.direction=null,this.head=[0,0,0],this.#n=this.#i=!0,this}look(t,e){if(!Number.isFinite(t+e))throw new E("gaze is no number");let[o,r]=this.about.eyes.degrees;for(let[i,n]of[["Left",1],["Right",-1]])this.set({["eyeLookOut"+i]:Number(n)*t/o,["eyeLookIn"+i]:-Number(n)*t/o,["eyeLookUp"+i]:e/r,["eyeLookDown"+i]:-e/r});return this.direction=[t,e],this}get gaze(){if(this.direction)return this.direction.map((n,c)=>Math.min(Math.max(n,-Ot[c]),Ot[c]));let[t,e]=this.about.eyes.degrees,o=n=>this.get(n),r=o("eyeLookOutLeft")-o("eyeLookInLeft")-o("eyeLookOutRight")+o("eyeLookInRight"),i=o("eyeLookUpLeft")-o("eyeLookDownLeft")+o("eyeLookUpRight")-o("eyeLookDownRight");return[t*r/2,e*i/2]}turn(t,e,o=0){if(!Number.isFinite(t+e+o))throw new E("a head turn is no number");return this.head=[t,e,o],this}get inPhoto(){return this.options.stage==="photo"&&this.hasPhoto}view(t=this.canvas.width,e=this.canvas.height){let{about:o,orbit:r}=this,i=r.shift.map(p=>p*e);if(this.inPhoto){let{width:p,height:u}=o.photo_camera,m=Math.min(t/p,e/u)*r.zoom;return O(F(o.photo_camera),[p/2,u/2],m,t,e,i)}let n=F(o.front_camera),c=.74*Math.min(t*1.12,e)/n.width,[a,l]=this.options.hair?this.#o.reach:[0,0],h=Math.min(c,Pt*e/a,Pt*t/l)*r.zoom,d=[n.width/2,n.height*.5],f=lt(O(n,d,h,t,e,i),r.yaw,r.pitch,[0,o.pivot[1],at]);return this.head.some(Boolean)?ft(f,K(...this.head),ce):f}frontView(t){let e=F(this.about.front_camera);return O(e,[e.width/2,e.height/2],t/e.width,t,t)}eyes(){let t=this.view();return this.about.eyes.centers.map(([e,o,r])=>{let[i,n,c]=C(t,[e,o,r+11]);return[i,n,13*t.focal/c]})}render(){if(this.#s)return;let t=performance.now();this.#a();let e=this.#t;e.bindFramebuffer(e.FRAMEBUFFER,null),e.viewport(0,0,this.canvas.width,this.canvas.height),this.#o.picture(this.view(),this.#f(),!1),this.stats.milliseconds=performance.now()-t}capture({width:t,height:e,view:o=this.view(t,e)}){let r=this.#t;this.#a();let i=new k(r,{format:r.RGBA8,width:t,height:e,depth:!0});i.bind(),this.#o.picture(o,this.#f(),!0);let n=Ct(r,t,e);return i.dispose(),he(n,t,e)}mouthSheet(){this.#a();let{mouth:t}=this.#o.targets;return t.bind(),{width:t.width,height:t.height,data:Ct(this.#t,t.width,t.height)}}#f(){let{weights:t,gaze:e,options:o,inPhoto:r}=this;return{weights:t,gaze:e,options:o,inPhoto:r,shown:this.index.get(o.layerExpression)??0}}#a(){let t=this.#o,{dynamic:e,hair:o}=this.options;t.start();let r=`${e} ${o}`;(this.#n||r!==this.#h)&&(t.compose(this.weights,e,o),this.mouths.find(this.weights)&&t.median(this.mouths),this.#n=!1,this.#h=r),this.inPhoto&&this.#i&&(t.pull(this.weights),this.#i=!1)}dispose(){this.#t.getExtension("WEBGL_lose_context")?.loseContext()}};function Ct(s,t,e){let o=new Uint8Array(4*t*e);return s.pixelStorei(s.PACK_ALIGNMENT,1),s.readPixels(0,0,t,e,s.RGBA,s.UNSIGNED_BYTE,o),s.bindFramebuffer(s.FRAMEBUFFER,null),o}function he(s,t,e){let o=new Uint8Array(s.length);for(let r=0;r<e;r++)o.set(s.subarray(4*t*r,4*t*(r+1)),4*t*(e-1-r));return o}export{ht as Avatar,E as AvatarError,We as MOST_GAZE,tt as decodeIndices,Q as decodeVertices,Ke as load,yt as parseHead};
